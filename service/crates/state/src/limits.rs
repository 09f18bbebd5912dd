//! How much of anything one vehicle may hold, checked before memory is taken.

use pdn_schemas::limits;
use pdn_schemas::record::Bounds;

/// How far the norm of a quaternion or direction may be from 1; within it the value is normalised.
pub(crate) const UNIT_TOLERANCE: f64 = 1e-6;

/// Bounds of one vehicle and of each of its missions. Each is named in the configuration of the daemon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Missions kept whole, the current one included; beyond it the one that ended first is forgotten.
    pub max_missions: usize,
    /// Mission ids that a vehicle may ever have used.
    pub max_mission_ids: usize,
    /// Events of one mission that may wait for a missing one.
    pub max_buffered_events: usize,
    /// Bytes, as sent, of the events that wait for a missing one, over all missions of the vehicle.
    pub max_buffered_bytes: usize,
    /// Events of one mission, applied and refused.
    pub max_events: u64,
    /// Keyframes of one mission.
    pub max_keyframes: usize,
    /// Factors of one mission.
    pub max_factors: usize,
    /// Factors that name one keyframe; what bounds the cost of a single elimination step.
    pub max_factors_per_keyframe: usize,
    /// Facets of a target.
    pub max_facets: usize,
    /// Cells of the coverage raster over all facets.
    pub max_cells: u64,
    /// Points of a survey.
    pub max_survey_points: usize,
    /// Bins of each saliency in the link model.
    pub max_link_bins: u32,
    /// Paths of one `rpc/evaluate`.
    pub max_paths: usize,
    /// Points of each of those paths.
    pub max_path_points: usize,
    /// Bytes of the reason of a command.
    pub max_reason_bytes: usize,
}

impl Limits {
    /// Those that decide which configurations and events a mission takes.
    pub(crate) fn bounds(&self) -> Bounds {
        Bounds {
            max_events: self.max_events,
            max_keyframes: self.max_keyframes as u64,
            max_factors: self.max_factors as u64,
            max_factors_per_keyframe: self.max_factors_per_keyframe as u64,
            max_facets: self.max_facets as u64,
            max_cells: self.max_cells,
            max_survey_points: self.max_survey_points as u64,
            max_link_bins: u64::from(self.max_link_bins),
            max_reason_bytes: self.max_reason_bytes as u64,
        }
    }

    /// These with the bounds of a mission.
    pub(crate) fn within(self, bounds: &Bounds) -> Limits {
        let count = |bound| usize::try_from(bound).unwrap_or(usize::MAX);
        Limits {
            max_events: bounds.max_events,
            max_keyframes: count(bounds.max_keyframes),
            max_factors: count(bounds.max_factors),
            max_factors_per_keyframe: count(bounds.max_factors_per_keyframe),
            max_facets: count(bounds.max_facets),
            max_cells: bounds.max_cells,
            max_survey_points: count(bounds.max_survey_points),
            max_link_bins: u32::try_from(bounds.max_link_bins).unwrap_or(u32::MAX),
            max_reason_bytes: count(bounds.max_reason_bytes),
            ..self
        }
    }
}

impl Default for Limits {
    /// The bounds of the contract; those that it does not name are this crate's own.
    fn default() -> Self {
        Limits {
            max_missions: 16,
            max_mission_ids: 65_536,
            max_buffered_events: limits::MAX_BUFFERED_EVENTS as usize,
            max_buffered_bytes: 16 << 20,
            max_events: 10_000_000,
            max_keyframes: limits::MAX_KEYFRAMES as usize,
            max_factors: limits::MAX_FACTORS as usize,
            max_factors_per_keyframe: 512,
            max_facets: limits::MAX_FACETS,
            max_cells: limits::MAX_COVERAGE_CELLS,
            max_survey_points: limits::MAX_SURVEY_POINTS,
            max_link_bins: limits::MAX_LINK_BINS,
            max_paths: limits::MAX_EVALUATED_PATHS,
            max_path_points: limits::MAX_PATH_POINTS,
            max_reason_bytes: limits::MAX_REASON_BYTES,
        }
    }
}
