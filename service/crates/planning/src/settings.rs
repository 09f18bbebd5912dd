//! The mission's settings as the method needs them: SI units, radians. Their defaults stand in the contract.

use crate::error::PlanningError;
use nalgebra::Vector6;

/// Everything in a mission's configuration that a decision depends on, but for target and link model.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Weight of the uncertainty against the area, in [0, 1] [PDN12, eq. 7].
    pub alpha: f64,
    /// The navigation uncertainty that the operator allows.
    pub allowable: Allowable,
    /// Local saliency from which a keyframe may be clustered [PDN12, III.B].
    pub waypoint_local_saliency: f64,
    /// Radius of DBSCAN, m.
    pub eps_m: f64,
    /// Keyframes within that radius, itself included, that make a core point.
    pub min_points: usize,
    /// Greatest distance of a waypoint's members from its representative, m; none: 24 times the median
    /// distance of consecutive keyframes.
    pub max_cluster_radius_m: Option<f64>,
    /// Two keyframes are connected for the search if closer than this, m; none: 2.6 times the median distance
    /// of consecutive keyframes.
    pub edge_radius_m: Option<f64>,
    /// Greatest distance of successive virtual nodes, m; none: the median distance of consecutive keyframes.
    pub sample_spacing_m: Option<f64>,
    /// A waypoint whose path is shorter is no candidate, m.
    pub min_revisit_m: f64,
    /// Shortest baseline of a registration, m; a millimetre at least, for a shorter one has no direction.
    pub min_baseline_m: f64,
    /// Longest baseline of a registration, m.
    pub max_baseline_m: f64,
    /// Greatest angle between the optical axes of a registration, rad.
    pub max_view_angle_rad: f64,
    /// Registrations that a virtual node proposes at most.
    pub max_links: usize,
    /// Width that a pass photographs, m.
    pub swath_m: f64,
    /// Whether virtual nodes get the information of attitude and depth sensors.
    pub expect_absolute: bool,
    /// Standard deviations of dead reckoning per square root of metre, `[m; rad]` in body axes
    /// [PDN12, eq. 1].
    pub odometry_sigmas_per_sqrt_m: Vector6<f64>,
    /// Standard deviation of each tilt, rad; none if there is no attitude sensor.
    pub tilt_sigma_rad: Option<f64>,
    /// Standard deviation of the heading, rad; none if it is not observed. Without tilt it has no meaning.
    pub heading_sigma_rad: Option<f64>,
    /// Standard deviation of the depth, m; none if there is no depth sensor.
    pub depth_sigma_m: Option<f64>,
    /// Standard deviation of each component of a registration's baseline direction, rad [PDN12, III.D].
    pub direction_sigma_rad: f64,
    /// Standard deviation of each component of a registration's relative rotation, rad [PDN12, III.D].
    pub rotation_sigma_rad: f64,
}

impl Settings {
    /// Refuses the first setting outside of what has a meaning.
    ///
    /// # Errors
    /// [`PlanningError::OutOfRange`] with the name that the setting has in the mission's configuration.
    pub fn check(&self) -> Result<(), PlanningError> {
        check_share("alpha", self.alpha)?;
        self.allowable.check()?;
        check_share("planner.waypoint_local_saliency", self.waypoint_local_saliency)?;
        check_positive("planner.eps_m", self.eps_m)?;
        check_at_least_one("planner.min_points", self.min_points)?;
        check_optional("planner.max_cluster_radius_m", self.max_cluster_radius_m)?;
        check_optional("planner.edge_radius_m", self.edge_radius_m)?;
        check_optional("planner.sample_spacing_m", self.sample_spacing_m)?;
        check_not_negative("planner.min_revisit_m", self.min_revisit_m)?;
        check_baseline(self.min_baseline_m)?;
        check_positive("planner.max_baseline_m", self.max_baseline_m)?;
        check_not_negative("planner.max_view_angle_deg", self.max_view_angle_rad.to_degrees())?;
        check_not_negative("planner.swath_m", self.swath_m)?;
        for index in 0..3 {
            let [translation, rotation] = [index, index + 3].map(|at| self.odometry_sigmas_per_sqrt_m[at]);
            check_positive("odometry.translation_sigma_m_per_sqrt_m", translation)?;
            check_positive("odometry.rotation_sigma_deg_per_sqrt_m", rotation.to_degrees())?;
        }
        check_optional("attitude.tilt_sigma_deg", self.tilt_sigma_rad.map(f64::to_degrees))?;
        check_optional("attitude.heading_sigma_deg", self.heading_sigma_rad.map(f64::to_degrees))?;
        check_optional("depth.sigma_m", self.depth_sigma_m)?;
        check_positive("camera.direction_sigma_deg", self.direction_sigma_rad.to_degrees())?;
        check_positive("camera.rotation_sigma_deg", self.rotation_sigma_rad.to_degrees())
    }
}

/// Standard deviations whose product is the determinant that uncertainty is measured by [PDN12, IV.A].
///
/// Worked numbers, the paper's allowance: |Sigma_allow|^(1/6) = 1.4922e-4.
///
/// ```
/// let tenth = 0.1_f64.to_radians();
/// let allowable = pdn_planning::Allowable {
///     x_m: 0.25, y_m: 0.25, depth_m: 0.01, roll_rad: tenth, pitch_rad: tenth, heading_rad: tenth,
/// };
/// let sixth_root = (allowable.log_determinant() / 6.0).exp();
/// assert!((sixth_root - 1.4922e-4).abs() < 0.5e-8);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowable {
    /// North, m.
    pub x_m: f64,
    /// East, m.
    pub y_m: f64,
    /// Down, m.
    pub depth_m: f64,
    /// rad.
    pub roll_rad: f64,
    /// rad.
    pub pitch_rad: f64,
    /// rad.
    pub heading_rad: f64,
}

impl Allowable {
    /// ln |Sigma_allow| = 2 sum ln sigma, which is about -53 for the paper's allowance: the determinant
    /// itself, 1e-23, would lose nothing here but everything where it is squared.
    pub fn log_determinant(&self) -> f64 {
        2.0 * self.sigmas().iter().map(|(_, sigma)| sigma.ln()).sum::<f64>()
    }

    /// Refuses a deviation that is not positive and finite.
    ///
    /// # Errors
    /// [`PlanningError::OutOfRange`] with the deviation's name; angles are told in radians.
    pub fn check(&self) -> Result<(), PlanningError> {
        self.sigmas().into_iter().try_for_each(|(name, sigma)| check_positive(name, sigma))
    }

    fn sigmas(&self) -> [(&'static str, f64); 6] {
        [
            ("allowable x, m,", self.x_m),
            ("allowable y, m,", self.y_m),
            ("allowable depth, m,", self.depth_m),
            ("allowable roll, rad,", self.roll_rad),
            ("allowable pitch, rad,", self.pitch_rad),
            ("allowable heading, rad,", self.heading_rad),
        ]
    }
}

/// Refuses what is not in [0, 1].
pub(crate) fn check_share(name: &'static str, value: f64) -> Result<(), PlanningError> {
    check(name, value, (0.0..=1.0).contains(&value), "in [0, 1]")
}

/// Refuses what is not finite and above zero.
pub(crate) fn check_positive(name: &'static str, value: f64) -> Result<(), PlanningError> {
    check(name, value, value.is_finite() && value > 0.0, "finite and above zero")
}

fn check_not_negative(name: &'static str, value: f64) -> Result<(), PlanningError> {
    check(name, value, value.is_finite() && value >= 0.0, "finite and not negative")
}

fn check_optional(name: &'static str, value: Option<f64>) -> Result<(), PlanningError> {
    value.map_or(Ok(()), |value| check_positive(name, value))
}

fn check_baseline(value: f64) -> Result<(), PlanningError> {
    check("planner.min_baseline_m", value, value.is_finite() && value >= 1e-3, "at least 0.001 m")
}

fn check_at_least_one(name: &'static str, value: usize) -> Result<(), PlanningError> {
    check(name, value as f64, value >= 1, "at least 1")
}

fn check(name: &'static str, value: f64, holds: bool, wanted: &'static str) -> Result<(), PlanningError> {
    if holds { Ok(()) } else { Err(PlanningError::OutOfRange { name, value, wanted }) }
}
