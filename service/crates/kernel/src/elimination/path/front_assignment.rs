//! Which front eliminates each place of a path.

use crate::elimination::assembly::NONE;
use crate::elimination::tree::Tree;

/// The place above all roots, where the terminal node is eliminated.
pub(super) const TOP: u32 = NONE;

/// The lowest front that is at or above both. `TOP` if there is none.
///
/// Levels grow towards the root, so of two different fronts the one of the lower level is not above the
/// other.
pub(super) fn common(tree: &Tree, one: u32, other: u32) -> u32 {
    let (mut one, mut other) = (one, other);
    while one != other {
        if one == TOP || other == TOP {
            return TOP;
        }
        if tree.front(one).shape.level <= tree.front(other).shape.level {
            one = tree.parent(one);
        } else {
            other = tree.parent(other);
        }
    }
    one
}

/// Whether `upper` is strictly above a front, given that one of them is above the other or they are the same.
pub(super) fn is_above(tree: &Tree, upper: u32, front: u32) -> bool {
    front != TOP && (upper == TOP || tree.front(upper).shape.level > tree.front(front).shape.level)
}

/// The front that eliminates each retained place: at or above all fronts in `anchors` that it is tied to, and
/// on one path to the root with the fronts of its neighbours along the path.
///
/// `anchors` are pairs of a retained place's index (any other number for the terminal node, which `TOP`
/// eliminates) and a front, in any order; each retained place has one. Neighbours that are not on one way are
/// brought there by raising the later one to what they have in common; a raise never breaks another such
/// relation, since what is above or below a front is above or below all that is above it, or on the way
/// there. So the fronts of the first places do not depend on the places after them.
pub(super) fn assign_fronts(tree: &Tree, count: usize, anchors: &[(u32, u32)], fronts: &mut Vec<u32>) {
    const UNSET: u32 = NONE - 1;
    fronts.clear();
    fronts.resize(count, UNSET);
    for &(retained, anchor) in anchors {
        if let Some(front) = fronts.get_mut(retained as usize) {
            *front = if *front == UNSET { anchor } else { common(tree, *front, anchor) };
        }
    }
    for place in 1..count {
        let (before, front) = (fronts[place - 1], fronts[place]);
        if front == UNSET {
            fronts[place] = before; // only the last place may have no link
            continue;
        }
        let shared = common(tree, before, front);
        if shared != before && shared != front {
            fronts[place] = shared;
        }
    }
}
