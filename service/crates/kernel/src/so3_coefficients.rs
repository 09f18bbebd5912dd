//! The scalar functions of the angle that the closed forms of SO(3) and SE(3) share, each with its slope.
//!
//! With s = theta^2 the left Jacobian of SO(3) is I + b(s) hat(phi) + c(s) hat(phi)^2 and its inverse I -
//! hat(phi) / 2 + e(s) hat(phi)^2. All are smooth in s; their closed forms cancel near zero, where their
//! power series are summed instead.

/// Below this theta^2 the series are used. Cancellation costs the closed forms a relative 1 / theta^4
/// roundings in the slopes, which enter with a factor theta^3; at theta = 1/2 that is a few roundings of the
/// result.
const SERIES_BELOW: f64 = 0.25;

/// A function of s = theta^2 and twice its derivative by s, which is its derivative by theta divided by
/// theta.
#[derive(Clone, Copy)]
pub(crate) struct Coefficient {
    pub value: f64,
    pub slope: f64,
}

/// b = (1 - cos theta) / theta^2.
pub(crate) fn first(s: f64) -> Coefficient {
    if s < SERIES_BELOW {
        // (-1)^k / (2k + 2)!; the first term left out is below 1e-19 of the first.
        return series(
            s,
            &[
                1.0 / 2.0,
                -1.0 / 24.0,
                1.0 / 720.0,
                -1.0 / 40_320.0,
                1.0 / 3_628_800.0,
                -1.0 / 479_001_600.0,
                1.0 / 87_178_291_200.0,
            ],
        );
    }
    let theta = s.sqrt();
    let half_sine = (0.5 * theta).sin();
    let value = 2.0 * half_sine * half_sine / s;
    Coefficient { value, slope: (theta.sin() / theta - 2.0 * value) / s }
}

/// c = (theta - sin theta) / theta^3.
pub(crate) fn second(s: f64) -> Coefficient {
    if s < SERIES_BELOW {
        // (-1)^k / (2k + 3)!
        return series(
            s,
            &[
                1.0 / 6.0,
                -1.0 / 120.0,
                1.0 / 5_040.0,
                -1.0 / 362_880.0,
                1.0 / 39_916_800.0,
                -1.0 / 6_227_020_800.0,
                1.0 / 1_307_674_368_000.0,
            ],
        );
    }
    let theta = s.sqrt();
    let half_sine = (0.5 * theta).sin();
    let value = (theta - theta.sin()) / (s * theta);
    Coefficient { value, slope: (2.0 * half_sine * half_sine / s - 3.0 * value) / s }
}

/// e = (1 - x cot x) / theta^2 with x = theta / 2; regular up to theta = 2 pi.
pub(crate) fn second_of_inverse(s: f64) -> Coefficient {
    if s < SERIES_BELOW {
        // |B_2k| / (2k)! with the Bernoulli numbers B; each term is about s / 39.5 of the one before it.
        return series(
            s,
            &[
                1.0 / 12.0,
                1.0 / 720.0,
                1.0 / 30_240.0,
                1.0 / 1_209_600.0,
                1.0 / 47_900_160.0,
                691.0 / 1_307_674_368_000.0,
                1.0 / 74_724_249_600.0,
                3_617.0 / 10_670_622_842_880_000.0,
            ],
        );
    }
    let x = 0.5 * s.sqrt();
    let (sine, cosine) = x.sin_cos();
    let x_cotangent = x * cosine / sine;
    let x_cosecant = x / sine;
    Coefficient {
        value: (1.0 - x_cotangent) / s,
        slope: (x_cosecant * x_cosecant + x_cotangent - 2.0) / (s * s),
    }
}

/// Sums a_0 + a_1 s + a_2 s^2 + ... and twice its derivative, by Horner's rule.
fn series(s: f64, coefficients: &[f64]) -> Coefficient {
    let (mut value, mut derivative) = (0.0, 0.0);
    for coefficient in coefficients.iter().rev() {
        derivative = derivative * s + value;
        value = value * s + coefficient;
    }
    Coefficient { value, slope: 2.0 * derivative }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// Series and closed form must meet where one hands over to the other. The closed slopes carry about
    /// 4 / theta^4 = 64 roundings of 1 there, against slopes of at least 1 / 360.
    #[test]
    fn series_and_closed_forms_meet() {
        for function in [first, second, second_of_inverse] {
            let (below, above) = (function(SERIES_BELOW * (1.0 - 1e-15)), function(SERIES_BELOW));
            assert!((below.value - above.value).abs() < 1e-14 * above.value.abs());
            assert!((below.slope - above.slope).abs() < 64.0 * f64::EPSILON);
        }
    }

    /// The slope is the derivative by theta over theta: central difference with h = 1e-5, whose own error is
    /// h^2 / 6 plus a rounding over h, about 2e-11.
    #[test]
    fn slopes_are_derivatives() {
        for function in [first, second, second_of_inverse] {
            for theta in [0.05, 0.2, 0.7, 1.5, 2.5, 3.1, PI] {
                let h: f64 = 1e-5;
                let at = |theta: f64| function(theta * theta);
                let difference = (at(theta + h).value - at(theta - h).value) / (2.0 * h);
                assert!((at(theta).slope * theta - difference).abs() < 1e-10);
            }
        }
    }
}
