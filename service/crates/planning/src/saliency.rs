//! Visual saliency [PDN12, III.A] [KE13]: what an image is worth for registration.

use crate::error::PlanningError;
use crate::settings::check_share;

/// The two scores of a keyframe, each in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saliency {
    /// S_L, texture richness: how well the image registers with another one of the same place.
    pub local: f64,
    /// S_G, rarity: how unlike the image is to all others of the mission.
    pub global: f64,
}

impl Saliency {
    /// A keyframe without a usable image.
    pub const NONE: Saliency = Saliency { local: 0.0, global: 0.0 };

    /// Ready scores of a vehicle.
    ///
    /// # Errors
    /// [`PlanningError::OutOfRange`] if one is outside [0, 1] or not a number.
    ///
    /// ```
    /// use pdn_planning::Saliency;
    /// assert_eq!(Saliency::ready(0.98, 0.7).unwrap().local, 0.98);
    /// assert!(Saliency::ready(1.01, 0.7).is_err() && Saliency::ready(0.98, f64::NAN).is_err());
    /// ```
    pub fn ready(local: f64, global: f64) -> Result<Saliency, PlanningError> {
        check_share("local saliency", local)?;
        check_share("global saliency", global)?;
        Ok(Saliency { local, global })
    }

    /// Whether the keyframe belongs to the salient set that waypoints are clustered from: S_L at or above
    /// `waypoint_local_saliency` [PDN12, III.B].
    pub fn is_salient(&self, waypoint_local_saliency: f64) -> bool {
        self.local >= waypoint_local_saliency
    }
}
