//! What snapshots share of a cache, with earlier ones or with later ones, changes no bit of what is found in
//! them.

use crate::draw::Draw;
use crate::mission::Mission;
use nalgebra::Vector3;
use pdn_kernel::Node;
use pdn_kernel::se3::Pose;
use pdn_planning::registration::links;
use pdn_planning::route::routes;
use pdn_planning::{Derived, DerivedCache, Question, Snapshot, SnapshotKeyframe, decide, waypoints};
use proptest::prelude::*;

/// Keyframes of the whole survey, of which a snapshot has those up to some node.
const LINES: usize = 3;
const ALONG: usize = 24;

/// What happens between two snapshots.
#[derive(Clone, Debug)]
enum Change {
    /// So many keyframes more.
    Add(usize),
    /// So many less, as when what came last is refused or an older state is asked.
    Remove(usize),
    /// Every so many keyframes move.
    Move { every: usize, far_m: f64, seed: u64 },
    /// Another edge radius or another radius of DBSCAN.
    Set { edge_radius_m: f64, eps_m: f64 },
}

fn changes() -> impl Strategy<Value = Vec<Change>> {
    let far_m = prop_oneof![3 => Just(1e-5), 2 => Just(0.02), 1 => Just(0.2)];
    let change = prop_oneof![
        3 => (1..4_usize).prop_map(Change::Add),
        1 => (1..4_usize).prop_map(Change::Remove),
        4 => (1..12_usize, far_m, any::<u64>())
            .prop_map(|(every, far_m, seed)| Change::Move { every, far_m, seed }),
        1 => (1.1..1.5_f64, 0.7..1.6_f64)
            .prop_map(|(edge_radius_m, eps_m)| Change::Set { edge_radius_m, eps_m }),
    ];
    prop::collection::vec(change, 1..15)
}

/// The survey as it goes on.
struct Survey {
    mission: Snapshot,
    poses: Vec<Pose>,
    keyframes: usize,
}

impl Survey {
    fn new(seed: u64) -> Survey {
        let mission = Mission::survey(LINES, ALONG, seed).snapshot;
        let poses = mission.keyframes.iter().map(|keyframe| keyframe.world_from_body).collect();
        Survey { mission, poses, keyframes: 40 }
    }

    fn apply(&mut self, change: &Change) {
        match *change {
            Change::Add(count) => self.keyframes = (self.keyframes + count).min(self.poses.len()),
            Change::Remove(count) => self.keyframes -= count.min(self.keyframes - 30),
            Change::Move { every, far_m, seed } => {
                let mut draw = Draw(seed);
                for pose in self.poses.iter_mut().step_by(every) {
                    *pose *= Pose::new(draw.vector(far_m), draw.vector(0.1 * far_m));
                }
            }
            Change::Set { edge_radius_m, eps_m } => {
                self.mission.settings.edge_radius_m = Some(edge_radius_m);
                self.mission.settings.eps_m = eps_m;
            }
        }
    }

    fn snapshot(&self, derived: Derived) -> Snapshot {
        let known = self.mission.keyframes.iter().zip(&self.poses).take(self.keyframes);
        Snapshot {
            keyframes: known
                .map(|(known, pose)| SnapshotKeyframe { world_from_body: *pose, ..*known })
                .collect(),
            newest: Some(Node(self.keyframes as u32 - 1)),
            went: self.mission.went[..self.keyframes - 1].to_vec(),
            elimination: self.mission.elimination.clone(),
            last_odometry: self.mission.last_odometry,
            covered_m2: 300.0,
            target_m2: 1200.0,
            link_model: self.mission.link_model.clone(),
            settings: self.mission.settings.clone(),
            derived,
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn a_snapshot_is_the_same_whatever_is_cached(seed: u64, changes in changes()) {
        let mut survey = Survey::new(seed);
        let (cache, mut draw) = (DerivedCache::default(), Draw(seed ^ 7));
        for (step, change) in changes.iter().enumerate() {
            survey.apply(change);
            let cached = survey.snapshot(Derived::with_cache(&cache));
            let fresh = survey.snapshot(Derived::default());
            if step % 3 == 1 {
                continue; // nothing was asked of it
            }
            prop_assert_eq!(cached.spacing_m(), fresh.spacing_m());
            prop_assert_eq!(waypoints(&cached).unwrap(), waypoints(&fresh).unwrap());
            let goals: Vec<Node> = (0..survey.keyframes as u32).map(Node).collect();
            prop_assert_eq!(routes(&cached, &goals).unwrap(), routes(&fresh, &goals).unwrap());
            for _ in 0..20 {
                let known = survey.poses[draw.below(survey.keyframes)];
                let place = known * Pose::new(draw.vector(0.5), draw.vector(0.1));
                let nearest = fresh.nearest(&place.translation.vector).unwrap();
                prop_assert_eq!(cached.nearest(&place.translation.vector).unwrap(), nearest);
                prop_assert_eq!(links(&cached, &place, nearest), links(&fresh, &place, nearest));
            }
        }
    }

    #[test]
    fn a_decision_is_the_same_whatever_is_cached(seed: u64, changes in changes(), choice_only: bool) {
        let mut survey = Survey::new(seed);
        let cache = DerivedCache::default();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let question = Question { choice_only, ..Question::default() };
        let mut last = None;
        for change in &changes {
            survey.apply(change);
            let cached = survey.snapshot(Derived::with_cache(&cache));
            last = Some(decide(&cached, &question, &pool, &|| false).unwrap());
        }
        let fresh = survey.snapshot(Derived::default());
        prop_assert_eq!(last, Some(decide(&fresh, &question, &pool, &|| false).unwrap()));
    }
}

/// Lists that stayed as they were first made would miss what has come near since.
#[test]
fn what_moves_far_is_found_where_it_is() {
    let mut survey = Survey::new(1);
    let cache = DerivedCache::default();
    let before = survey.snapshot(Derived::with_cache(&cache));
    let far = before.keyframes[5].world_from_body.translation.vector + Vector3::new(0.0, 900.0, 0.0);
    assert_ne!(before.nearest(&far).unwrap(), Node(7));
    survey.poses[7].translation.vector = far;
    let after = survey.snapshot(Derived::with_cache(&cache));
    assert_eq!(after.nearest(&far).unwrap(), Node(7));
    assert_eq!(routes(&after, &[Node(7)]).unwrap(), [None]);
}
