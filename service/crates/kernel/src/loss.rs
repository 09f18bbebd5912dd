//! Robust losses: how much a factor counts when the estimate disagrees with it.
//!
//! A factor's information is multiplied by w(r), with r the norm of its whitened residual at the
//! linearisation point (iteratively re-weighted least squares: w is held constant while a Gauss-Newton step
//! is solved).

use crate::KernelError;

/// How the information of a factor shrinks with its whitened residual norm r.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Loss {
    /// w = 1: the measurement counts fully, whatever it says.
    #[default]
    None,
    /// w = min(1, c / r): an outlier pulls with a bounded force. c > 0, in standard deviations.
    Huber(f64),
    /// w = 1 / (1 + r^2 / c^2): a far outlier hardly pulls. c > 0, in standard deviations.
    Cauchy(f64),
}

impl Loss {
    /// The weight w in (0, 1] of a residual with squared whitened norm `r_squared`.
    ///
    /// ```
    /// use pdn_kernel::Loss;
    /// assert_eq!(Loss::None.weight(100.0), 1.0);
    /// assert_eq!(Loss::Huber(2.0).weight(1.0), 1.0);
    /// assert_eq!(Loss::Huber(2.0).weight(16.0), 0.5);
    /// assert_eq!(Loss::Cauchy(2.0).weight(4.0), 0.5);
    /// ```
    pub fn weight(self, r_squared: f64) -> f64 {
        match self {
            Loss::None => 1.0,
            Loss::Huber(c) => {
                if r_squared <= c * c {
                    1.0
                } else {
                    c / r_squared.sqrt()
                }
            }
            Loss::Cauchy(c) => 1.0 / (1.0 + r_squared / (c * c)),
        }
    }

    /// Refuses a scale c that is not a positive finite number (`NotPositive`).
    pub fn validate(self) -> Result<(), KernelError> {
        match self {
            Loss::None => Ok(()),
            Loss::Huber(c) | Loss::Cauchy(c) if c > 0.0 && c.is_finite() => Ok(()),
            Loss::Huber(c) | Loss::Cauchy(c) => {
                Err(KernelError::NotPositive { what: "scale of the robust loss", value: c })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        // The weight is rho'(r) / r of the known losses: Huber's force w r is r up to c and then c; Cauchy's
        // force is the derivative of (c^2 / 2) ln(1 + r^2 / c^2). Tolerance: a few roundings, and for the
        // second the error h^2 / 6 of a central difference with h = 1e-4 r.
        #[test]
        fn weight_is_the_slope_of_the_loss(r in 0.01..100.0f64, c in 0.1..10.0f64) {
            let huber_force = Loss::Huber(c).weight(r * r) * r;
            prop_assert!((huber_force - r.min(c)).abs() <= 4.0 * f64::EPSILON * r);
            let cauchy = |r: f64| 0.5 * c * c * (r * r / (c * c)).ln_1p();
            let h = 1e-4 * r;
            let slope = (cauchy(r + h) - cauchy(r - h)) / (2.0 * h);
            prop_assert!((Loss::Cauchy(c).weight(r * r) * r - slope).abs() <= 1e-6 * slope);
        }

        #[test]
        fn weight_lies_in_the_unit_interval_and_falls(a in 0.0..1e6f64, b in 0.0..1e6f64, c in 0.1..10.0f64) {
            for loss in [Loss::None, Loss::Huber(c), Loss::Cauchy(c)] {
                let (near, far) = (loss.weight(a.min(b)), loss.weight(a.max(b)));
                prop_assert!(0.0 < far && far <= near && near <= 1.0);
            }
        }
    }

    #[test]
    fn scales_that_are_not_positive_are_refused() {
        for c in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(Loss::Huber(c).validate(), Err(KernelError::NotPositive { .. })));
            assert!(matches!(Loss::Cauchy(c).validate(), Err(KernelError::NotPositive { .. })));
        }
        assert_eq!(Loss::Cauchy(2.385).validate(), Ok(()));
    }
}
