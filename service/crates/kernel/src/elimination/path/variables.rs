//! The unknowns by which a round trip enters the elimination.
//!
//! The two nodes x and y of a place, of the outbound and of the inbound leg, have the same linearisation
//! point and register with the same keyframes by the same information. In their sum s = x + y and difference
//! d = x - y every registration is with s alone, by the same cross block: d is joined to nothing but the
//! places next to it. So a front that holds a linked keyframe, below the front where the place itself is
//! eliminated, carries one block row for the place and not two. Nothing is approximated, nor even rounded: x
//! = (s + d) / 2 and y = (s - d) / 2 scale blocks by powers of two. (The orthogonal transformation, with its
//! square roots of 2, tripled the error of the covariance.)

/// Ids of the unknowns of a path, above those of the keyframes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Variables {
    /// Number of keyframes: the least id.
    pub base: u32,
    /// Number of retained places.
    pub retained: u32,
}

/// A node as a combination of unknowns: their ids and coefficients.
pub(super) type Combination = [(u32, f64); 2];

/// Which leg of the round trip a node belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Leg {
    Outbound,
    Inbound,
}

impl Variables {
    /// The terminal node, which is an unknown of its own.
    pub(super) fn terminal(self) -> u32 {
        self.base
    }

    /// The sum of a retained place's two nodes; of the last place, which has one node, that one.
    pub(super) fn sum(self, retained: u32) -> u32 {
        self.base + 1 + 2 * retained
    }

    /// The unknowns of a retained place.
    pub(super) fn of(self, retained: u32) -> impl Iterator<Item = u32> {
        let sum = self.sum(retained);
        std::iter::once(sum).chain((retained + 1 < self.retained).then_some(sum + 1))
    }

    /// What each of them has of the information that each node of the place has on its own.
    pub(super) fn own_share(self, retained: u32) -> f64 {
        if retained + 1 == self.retained { 1.0 } else { 0.5 }
    }

    /// Ids go up to this number, exclusive.
    pub(super) fn id_bound(self) -> usize {
        (self.base + 1 + 2 * self.retained) as usize
    }

    /// The retained place that an unknown belongs to; none for the terminal node. The id must be one of a
    /// path.
    pub(super) fn retained_of(self, id: u32) -> Option<u32> {
        (id - self.base).checked_sub(1).map(|place| place / 2)
    }

    /// The node of one leg at a retained place.
    pub(super) fn node(self, retained: u32, leg: Leg) -> Combination {
        let sum = self.sum(retained);
        if retained + 1 == self.retained {
            return [(sum, 1.0), (sum, 0.0)];
        }
        let sign = if leg == Leg::Outbound { 1.0 } else { -1.0 };
        [(sum, 0.5), (sum + 1, sign * 0.5)]
    }

    /// The node of one leg before the first retained place: the robot, or the terminal node.
    pub(super) fn start(self, robot: u32, leg: Leg) -> Combination {
        let id = if leg == Leg::Outbound { robot } else { self.terminal() };
        [(id, 1.0), (id, 0.0)]
    }
}
