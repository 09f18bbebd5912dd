//! Numbers drawn the same way on every machine.

use nalgebra::{Vector3, Vector6};

/// SplitMix64.
pub struct Draw(pub u64);

impl Draw {
    /// Even in [0, 1).
    pub fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Standard normal (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.share()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.share()).cos()
    }

    /// Independent normal entries with these deviations.
    pub fn normals(&mut self, sigmas: &Vector6<f64>) -> Vector6<f64> {
        sigmas.map(|sigma| sigma * self.normal())
    }

    /// Independent normal entries with one deviation.
    pub fn normals_of(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| sigma * self.normal())
    }
}
