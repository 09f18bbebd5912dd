//! What follows from eqs. 5 to 9.

use crate::draw::Draw;
use crate::mission::settings;
use nalgebra::Matrix6;
use pdn_kernel::se3::Pose;
use pdn_planning::reward::{Scale, choose};
use pdn_planning::{Action, Candidate, Exploration};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn without_weight_on_uncertainty_exploring_wins(seed: u64) {
        let (scale, exploration, candidates) = drawn(seed, 0.0, 0.2..3.0);
        prop_assert_eq!(choose(&exploration, &candidates), Action::Explore);
        prop_assert_eq!(exploration.penalty, scale.area(0.0));
    }

    #[test]
    fn below_the_allowance_exploring_wins_for_every_alpha(seed: u64, alpha in 0.0..=1.0_f64) {
        let (_, exploration, candidates) = drawn(seed, alpha, 0.2..0.999);
        prop_assert_eq!(exploration.uncertainty, 0.0);
        prop_assert!(exploration.uncertainty_ratio > 0.0);
        prop_assert_eq!(choose(&exploration, &candidates), Action::Explore);
        prop_assert!(candidates.iter().all(|candidate| candidate.break_even_alpha.is_none()));
    }

    #[test]
    fn the_choice_flips_at_the_break_even_alpha(seed: u64) {
        let (_, exploration, candidates) = drawn(seed, 0.5, 1.05..3.0);
        for (index, candidate) in candidates.iter().enumerate() {
            let Some(break_even) = candidate.break_even_alpha else {
                let (_, exploration, candidates) = drawn(seed, 1.0, 1.05..3.0);
                prop_assert!(candidate.uncertainty >= exploration.uncertainty);
                prop_assert_eq!(choose(&exploration, &candidates[index..=index]), Action::Explore);
                continue;
            };
            // Penalties of about 1 are rounded by 1e-16; over 1e-9 of alpha they part by 1e-11 at least,
            // since the uncertainties drawn here differ by more than 0.01.
            if exploration.uncertainty - candidate.uncertainty < 0.01 || break_even > 1.0 - 1e-9 {
                continue;
            }
            for (alpha, revisits) in [(break_even + 1e-9, true), (break_even - 1e-9, false)] {
                let (_, exploration, candidates) = drawn(seed, alpha, 1.05..3.0);
                let action = choose(&exploration, &candidates[index..=index]);
                prop_assert_eq!(action != Action::Explore, revisits, "{:?} at {}", action, alpha);
            }
        }
    }

    #[test]
    fn the_least_penalty_wins_and_ties_go_to_exploring_then_to_the_lower_number(
        seed: u64,
        alpha in 0.0..=1.0_f64,
    ) {
        let (_, exploration, mut candidates) = drawn(seed, alpha, 1.05..3.0);
        let again: Vec<Candidate> = candidates.iter().cloned()
            .map(|candidate| Candidate { candidate: candidate.candidate + 100, ..candidate }).collect();
        candidates.extend(again);
        let penalty = |number: u32| candidates.iter().find(|one| one.candidate == number).unwrap().penalty;
        match choose(&exploration, &candidates) {
            Action::Explore => prop_assert!(candidates.iter().all(|one| one.penalty >= exploration.penalty)),
            Action::Revisit { candidate, .. } => {
                prop_assert!(candidate < 100 && penalty(candidate) < exploration.penalty);
                prop_assert!(candidates.iter().all(|one| one.penalty >= penalty(candidate)));
            }
        }
        let tied = Exploration { penalty: candidates[0].penalty, ..exploration };
        prop_assert_eq!(choose(&tied, &candidates[..1]), Action::Explore);
    }
}

#[test]
fn the_ratio_grows_with_the_square_of_the_deviations() {
    let (scale, ..) = drawn(1, 0.5, 0.2..3.0);
    let allowable = settings().allowable;
    let sigmas = [allowable.x_m, allowable.y_m, allowable.depth_m, allowable.roll_rad, allowable.pitch_rad];
    let mut covariance = Matrix6::identity();
    for (index, sigma) in sigmas.into_iter().chain([allowable.heading_rad]).enumerate() {
        covariance[(index, index)] = (1.3 * sigma).powi(2);
    }
    // ln |Sigma| is about -50, rounded by 1e-14; a sixth of it is exponentiated.
    assert!((scale.uncertainty_ratio(&covariance).unwrap() - 1.3 * 1.3).abs() < 1e-13);
    covariance[(0, 0)] = -1.0;
    assert!(scale.uncertainty_ratio(&covariance).is_err());
}

/// Exploration whose ratio lies in a range, and five candidates with ratios from 0.1 to 2.
fn drawn(seed: u64, alpha: f64, ratio: std::ops::Range<f64>) -> (Scale, Exploration, Vec<Candidate>) {
    let mut draw = Draw(seed);
    let scale = Scale {
        alpha,
        allowable: settings().allowable,
        target_m2: 1200.0,
        covered_m2: draw.between(0.0, 1300.0),
        swath_m: 1.6,
    };
    let mut with_ratio = |least: f64, greatest: f64| {
        let sigma = (scale.allowable.log_determinant() / 12.0).exp() * draw.between(least, greatest).sqrt();
        Matrix6::from_diagonal_element(sigma * sigma)
    };
    let exploration = scale.exploration(with_ratio(ratio.start, ratio.end)).unwrap();
    let covariances = [(); 5].map(|()| with_ratio(0.1, 2.0));
    let candidates = covariances.into_iter().zip(1..).map(|(covariance, number)| {
        let uncertainty = scale.uncertainty_ratio(&covariance).unwrap();
        let one_way_m = draw.between(3.0, 40.0);
        let detour = scale.detour(one_way_m);
        let penalty = scale.penalty(uncertainty, detour.area);
        Candidate {
            candidate: number,
            keyframe: Some(10 * u64::from(number)),
            path: Vec::new(),
            one_way_m,
            nodes: 2,
            covariance,
            uncertainty,
            uncertainty_all_links: uncertainty,
            uncertainty_no_links: uncertainty,
            peak_uncertainty: uncertainty,
            redundant_m2: detour.redundant_m2,
            area: detour.area,
            penalty,
            reward: -penalty,
            break_even_alpha: scale.break_even_alpha(
                exploration.uncertainty,
                uncertainty,
                detour.redundant_m2,
            ),
            expected_links: 0.0,
            poses: vec![Pose::identity(); 2],
            links: Vec::new(),
        }
    });
    let candidates = candidates.collect();
    (scale, exploration, candidates)
}
