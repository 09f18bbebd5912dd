//! The unknowns by which a round trip enters the elimination.
//!
//! The two nodes x and y of a place, of the way out and of the way back, have the same linearisation point and register
//! with the same keyframes by the same information. In their sum s = x + y and difference d = x - y every registration
//! is with s alone, by the same cross block: d is joined to nothing but the places next to it. So a front that holds a linked
//! keyframe, below the front where the place itself is eliminated, carries one block row for the place and not two.
//! Nothing is approximated, nor even rounded: x = (s + d) / 2 and y = (s - d) / 2 scale blocks by powers of two. (The
//! orthogonal transformation, with its square roots of 2, tripled the error of the covariance.)

/// Ids of the unknowns of a path, above those of the keyframes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Variables {
    /// Number of keyframes: the least id.
    pub base: u32,
    /// Number of kept places.
    pub kept: u32,
}

/// A node as a combination of unknowns: their ids and coefficients.
pub(super) type Combination = [(u32, f64); 2];

/// Which way a node belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Way {
    Out,
    Back,
}

impl Variables {
    /// The terminal node, which is an unknown of its own.
    pub(super) fn terminal(self) -> u32 {
        self.base
    }

    /// The sum of a kept place's two nodes; of the last place, which has one node, that one.
    pub(super) fn sum(self, kept: u32) -> u32 {
        self.base + 1 + 2 * kept
    }

    /// The unknowns of a kept place.
    pub(super) fn of(self, kept: u32) -> impl Iterator<Item = u32> {
        let sum = self.sum(kept);
        std::iter::once(sum).chain((kept + 1 < self.kept).then_some(sum + 1))
    }

    /// What each of them has of the information that each node of the place has on its own.
    pub(super) fn own_share(self, kept: u32) -> f64 {
        if kept + 1 == self.kept { 1.0 } else { 0.5 }
    }

    /// Ids go up to this number, exclusive.
    pub(super) fn id_bound(self) -> usize {
        (self.base + 1 + 2 * self.kept) as usize
    }

    /// The kept place that an unknown belongs to; none for the terminal node. The id must be one of a path.
    pub(super) fn kept_of(self, id: u32) -> Option<u32> {
        (id - self.base).checked_sub(1).map(|place| place / 2)
    }

    /// The node of one way at a kept place.
    pub(super) fn node(self, kept: u32, way: Way) -> Combination {
        let sum = self.sum(kept);
        if kept + 1 == self.kept {
            return [(sum, 1.0), (sum, 0.0)];
        }
        let sign = if way == Way::Out { 1.0 } else { -1.0 };
        [(sum, 0.5), (sum + 1, sign * 0.5)]
    }

    /// The node of one way before the first kept place: the robot, or the terminal node.
    pub(super) fn start(self, robot: u32, way: Way) -> Combination {
        let id = if way == Way::Out { robot } else { self.terminal() };
        [(id, 1.0), (id, 0.0)]
    }
}
