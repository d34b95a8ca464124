//! Random draws.

use lobes::glam::DVec3;
use rand::RngExt;
use rand_pcg::Pcg64;

/// Draws from one generator.
#[derive(Debug)]
pub(super) struct Draw(pub(super) Pcg64);

impl Draw {
    /// Uniform in 0 … 1.
    pub(super) fn unit(&mut self) -> f64 {
        self.0.random()
    }

    /// Uniform between two values.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// The logarithm is uniform.
    pub(super) fn log_between(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// True with a probability.
    pub(super) fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// One of 0 … `count` − 1.
    pub(super) fn index(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count - 1)
    }

    /// A direction, uniform on the sphere.
    pub(super) fn direction(&mut self) -> DVec3 {
        let z = self.between(-1.0, 1.0);
        let (sin, cos) = self.between(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }

    /// Three orthogonal directions, uniform over the rotations.
    pub(super) fn frame(&mut self) -> [DVec3; 3] {
        let z = self.direction();
        let other = self.direction();
        let x = (other - z * other.dot(z)).normalize_or(z.any_orthonormal_vector());
        [x, z.cross(x), z]
    }

    /// Any number for a generator's seed.
    pub(super) fn seed(&mut self) -> u64 {
        self.0.random()
    }

    /// A standard normal deviate.
    pub(super) fn normal(&mut self) -> f64 {
        lobes::picture::normal(&mut self.0)
    }

    /// A colour of any hue, of saturation and value on 0 … 1 (Smith 1978,
    /// doi:10.1145/965139.807361).
    pub(super) fn colour(&mut self, saturation: f64, value: f64) -> [f64; 3] {
        let hue = 6.0 * self.unit();
        [0.0, 4.0, 2.0].map(|shift| {
            let k = (hue + shift).rem_euclid(6.0);
            // 1 within one sixth of the hue, 0 beyond a third.
            let ramp = ((k - 3.0).abs() - 1.0).clamp(0.0, 1.0);
            value * (1.0 - saturation * (1.0 - ramp))
        })
    }
}

/// What lies between two colours: the first at t = 0, the second at 1.
pub(super) fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
}

/// Channel by channel.
pub(super) fn times(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] * b[c])
}

/// 0 below `low`, 1 above `high`, a cubic between.
pub(super) fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
