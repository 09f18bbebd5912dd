//! Configurations, commands and requests.

use super::{Vectors, edges};
use pdn_schemas::command::{Command, EvaluateRequest};
use pdn_schemas::config::{
    Allowable, Attitude, Camera, Criterion, Depth, Facet, FirstKeyframeSigmas, LinkModel, Loss,
    MissionConfig, Odometry, Planner, Robust, Target,
};
use pdn_schemas::shared::Pose;

pub fn add(vectors: &mut Vectors) {
    vectors.add("default", &default());
    vectors.add("full", &full());

    vectors.add("empty", &Command { reason: String::new() });
    vectors
        .add("reason", &Command { reason: "wind \"force\" 7, swell\n3 m \u{2014} \u{00b5}\u{1f30a}".into() });

    vectors.add("empty", &EvaluateRequest { paths: Vec::new() });
    let path: Vec<[f64; 3]> = (0..300).map(|step| [f64::from(step) * 0.1, -0.0, 5.0]).collect();
    vectors.add("paths", &EvaluateRequest { paths: vec![Vec::new(), vec![edges(), edges()], path] });
}

/// A configuration that gives only what has no default.
pub fn default() -> MissionConfig {
    MissionConfig {
        mission: "m".into(),
        target: Target { facets: vec![facet()], area_m2: None },
        allowable: Allowable::default(),
        alpha: 1.0,
        camera: Camera::default(),
        odometry: Odometry::default(),
        attitude: Attitude::default(),
        depth: Depth::default(),
        planner: Planner::default(),
        link_model: LinkModel::default(),
        robust: Robust::default(),
        cell_m: 0.1,
        survey: None,
        first_keyframe_sigmas: Some(FirstKeyframeSigmas::default()),
        gate_sigmas: Some(20.0),
    }
}

fn facet() -> Facet {
    Facet {
        origin: [0.0, 0.0, 10.0],
        u: [1.0, 0.0, 0.0],
        v: [0.0, 1.0, 0.0],
        length_u_m: 40.0,
        length_v_m: 20.0,
    }
}

/// A configuration in which nothing is as by default.
pub fn full() -> MissionConfig {
    let steep =
        Facet { origin: edges(), u: [0.0, 0.6, 0.8], v: [1.0, 0.0, 0.0], length_u_m: 0.1, length_v_m: 1e4 };
    MissionConfig {
        mission: "full-1".into(),
        target: Target { facets: vec![facet(), steep], area_m2: Some(1200.0) },
        allowable: Allowable {
            x_m: 0.5,
            y_m: 0.4,
            depth_m: 0.02,
            roll_deg: 0.2,
            pitch_deg: 0.3,
            heading_deg: 1.0,
        },
        alpha: 0.75,
        camera: Camera {
            body_from_camera: Pose { translation: [0.3, 0.0, 0.1], rotation: [0.5, 0.5, 0.5, 0.5] },
            horizontal_fov_deg: 60.0,
            vertical_fov_deg: 50.0,
            max_range_m: 4.5,
            direction_sigma_deg: 0.7,
            rotation_sigma_deg: 0.07,
        },
        odometry: Odometry {
            translation_sigma_m_per_sqrt_m: [0.01, 0.02, 0.03],
            rotation_sigma_deg_per_sqrt_m: [0.1, 0.2, 0.3],
        },
        attitude: Attitude { tilt_sigma_deg: None, heading_sigma_deg: None },
        depth: Depth { sigma_m: None },
        planner: Planner {
            waypoint_local_saliency: 0.6,
            eps_m: 2.0,
            min_points: 5,
            max_cluster_radius_m: Some(7.5),
            edge_radius_m: Some(1.25),
            sample_spacing_m: Some(0.5),
            min_revisit_m: 4.0,
            min_baseline_m: 0.2,
            max_baseline_m: 1.1,
            max_view_angle_deg: 25.0,
            max_links: 3,
            swath_m: 1.4,
            expect_absolute: false,
            criterion: Criterion::Determinant,
        },
        link_model: LinkModel { bins: 1, prior: vec![[3.0, 7.0]] },
        robust: Robust {
            prior: Loss::None,
            odometry: Loss::Huber(1.345),
            relative: Loss::Cauchy(1.0),
            camera: Loss::None,
            attitude: Loss::Huber(2.0),
            depth: Loss::Cauchy(5e-324),
            position: Loss::Huber(f64::MAX),
        },
        cell_m: 0.25,
        survey: Some(vec![[0.0, 0.0, 5.0], [40.0, 0.0, 5.0], edges()]),
        first_keyframe_sigmas: None,
        gate_sigmas: None,
    }
}
