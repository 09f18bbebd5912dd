//! Distances that decide are compared to the nanometre.
//!
//! Survey lines are regular, so ties are common: the middle of a bisected piece is as far from one keyframe
//! as from the other, and keyframes lie a whole number of spacings apart. Rounding errors of 1e-16 m must not
//! break such ties, or another machine (and whoever checks a decision) would choose otherwise.

/// A distance in whole nanometres, rounded: what thresholds and orders compare.
///
/// `distance_m` in metres, finite and not negative; beyond 9.2e9 m it saturates.
///
/// ```
/// use pdn_planning::distance::nanometres;
/// assert_eq!(nanometres(0.1 + 0.2), nanometres(0.3));
/// assert!(nanometres(0.3) < nanometres(0.300_000_002));
/// ```
pub fn nanometres(distance_m: f64) -> i64 {
    (distance_m * 1e9).round() as i64
}

/// Whether a distance is less than another one, in whole nanometres. Rounding is left out where it cannot
/// matter.
pub(crate) fn is_less(distance_m: f64, limit_m: f64) -> bool {
    let beyond_m = distance_m - limit_m;
    if beyond_m.abs() > 1e-8 { beyond_m < 0.0 } else { nanometres(distance_m) < nanometres(limit_m) }
}

/// Median of lengths; the mean of the two middle ones when their number is even; none of none. Cost: linear.
///
/// ```
/// use pdn_planning::distance::median;
/// assert_eq!([median(vec![3.0, 1.0, 2.5]), median(vec![3.0, 0.5, 1.0, 2.0])], [Some(2.5), Some(1.5)]);
/// ```
pub fn median(mut lengths_m: Vec<f64>) -> Option<f64> {
    let half = lengths_m.len() / 2;
    if lengths_m.is_empty() {
        return None;
    }
    let is_odd = lengths_m.len() % 2 == 1;
    let (below, &mut middle, _) = lengths_m.select_nth_unstable_by(half, f64::total_cmp);
    let before = below.iter().copied().max_by(f64::total_cmp);
    Some(before.filter(|_| !is_odd).map_or(middle, |before| 0.5 * (before + middle)))
}
