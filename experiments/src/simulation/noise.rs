//! Noise in space, the same for the same seed.

use lobes::glam::DVec3;

/// A field of values in −1 … 1 that varies over a distance of about 1: random values at the
/// integer points, and between them a polynomial of degree five in each coordinate, whose first two
/// derivatives are continuous (Perlin 2002, doi:10.1145/566654.566636).
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise {
    pub(super) seed: u64,
}

impl Noise {
    /// The value at a point.
    pub(super) fn at(self, p: DVec3) -> f64 {
        let floor = p.floor();
        let fade = |t: f64| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
        let f = p - floor;
        let (u, v, w) = (fade(f.x), fade(f.y), fade(f.z));
        let (x, y, z) = (floor.x as i64, floor.y as i64, floor.z as i64);
        let corner = |i: i64, j: i64, k: i64| unit(self.hash(x + i, y + j, z + k)) * 2.0 - 1.0;
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let row = |j: i64, k: i64| mix(corner(0, j, k), corner(1, j, k), u);
        mix(
            mix(row(0, 0), row(1, 0), v),
            mix(row(0, 1), row(1, 1), v),
            w,
        )
    }

    /// Octaves from `frequency` on, each of twice the frequency and `gain` times the amplitude of
    /// the one before, over their root mean square sum.
    pub(super) fn octaves(self, p: DVec3, frequency: f64, octaves: u32, gain: f64) -> f64 {
        let (mut sum, mut squares, mut amplitude, mut scale) = (0.0, 0.0, 1.0, frequency);
        for octave in 0..octaves {
            let shift = DVec3::splat(17.3 * f64::from(octave));
            sum += amplitude * self.at(p * scale + shift);
            squares += amplitude * amplitude;
            amplitude *= gain;
            scale *= 2.0;
        }
        sum / f64::sqrt(squares)
    }

    /// The nearest of the random points, one in each unit cube: the offset to it.
    pub(super) fn nearest(self, p: DVec3) -> DVec3 {
        let floor = p.floor();
        let (x, y, z) = (floor.x as i64, floor.y as i64, floor.z as i64);
        let mut best = DVec3::splat(9.0);
        for i in -1..=1 {
            for j in -1..=1 {
                for k in -1..=1 {
                    let h = self.hash(x + i, y + j, z + k);
                    let of = DVec3::new(unit(h), unit(mixed(h ^ 1)), unit(mixed(h ^ 2)));
                    let to = floor + DVec3::new(i as f64, j as f64, k as f64) + of - p;
                    if to.length_squared() < best.length_squared() {
                        best = to;
                    }
                }
            }
        }
        best
    }

    fn hash(self, x: i64, y: i64, z: i64) -> u64 {
        let mut h = self.seed;
        for part in [x, y, z] {
            h = mixed(h ^ part as u64);
        }
        h
    }
}

/// `SplitMix64`'s step (Steele, Lea and Flood 2014, doi:10.1145/2660193.2660195).
fn mixed(x: u64) -> u64 {
    let mut z = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn unit(h: u64) -> f64 {
    (h >> 11) as f64 / (1u64 << 53) as f64
}
