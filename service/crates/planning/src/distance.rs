//! Distances that decide are compared to the nanometre.
//!
//! Survey lines are regular, so ties are common: the middle of a bisected piece is as far from one keyframe as
//! from the other, and keyframes lie a whole number of spacings apart. Rounding errors of 1e-16 m must not
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

/// Median of lengths; the mean of the two middle ones when their number is even; none of none.
pub fn median(mut lengths_m: Vec<f64>) -> Option<f64> {
    lengths_m.sort_by(f64::total_cmp);
    let half = lengths_m.len() / 2;
    match lengths_m.len() {
        0 => None,
        odd if odd % 2 == 1 => Some(lengths_m[half]),
        _ => Some(0.5 * (lengths_m[half - 1] + lengths_m[half])),
    }
}
