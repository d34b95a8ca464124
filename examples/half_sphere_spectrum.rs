//! The power spectrum of half a sphere, without guessing what is behind.
//!
//!     cargo run --release --example half_sphere_spectrum
//!
//! Random fields of a known spectrum are seen on a hemisphere only. Filling the back with a mirror
//! image biases their spectrum; undoing the coupling that the mask makes between degrees (MASTER,
//! doi:10.1086/338126) does not.

use lobes::harmonics::{Coefficients, Coupling, Mask, Transform, average_power};
use lobes::sphere::Grid;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const DEGREE: usize = 40;
const FIELDS: usize = 200;
const EDGES: [usize; 6] = [0, 4, 8, 16, 32, 41];

fn main() -> lobes::Result<()> {
    let truth: Vec<f64> = (0..=DEGREE).map(|l| (l as f64 + 1.0).powf(-2.3)).collect();
    let mask = Mask::Cap {
        radius: std::f64::consts::FRAC_PI_2,
    };
    let coupling = Coupling::new(mask, DEGREE)?;
    // A masked field is not band-limited: a finer grid than the degree asks for.
    let grid = Grid::gauss_legendre(4 * DEGREE, 4 * DEGREE)?;
    let transform = Transform::new(&grid, DEGREE)?;
    let mut generator = Pcg64::seed_from_u64(1);

    let mut masked_power = vec![0.0; DEGREE + 1];
    for _ in 0..FIELDS {
        let mut field = Coefficients::zeros(DEGREE);
        for l in 0..=DEGREE {
            for m in -(l as isize)..=l as isize {
                // Twelve uniform numbers make a near enough normal one.
                let normal = (0..12).map(|_| generator.random::<f64>()).sum::<f64>() - 6.0;
                field.set(l, m, truth[l].sqrt() * normal)?;
            }
        }
        let mut map = transform.synthesise(&field)?;
        mask.apply(&grid, &mut map)?;
        for (sum, power) in masked_power
            .iter_mut()
            .zip(average_power(&transform.analyse(&map)?))
        {
            *sum += power / FIELDS as f64;
        }
    }

    let bands = coupling.decouple(&masked_power, &EDGES, |l| truth[l])?;
    println!("degrees   masked/true   decoupled/true");
    for (band, edges) in bands.iter().zip(EDGES.windows(2)) {
        let share = |power: &[f64]| power[edges[0]..edges[1]].iter().sum::<f64>();
        let masked = share(&masked_power) / share(&truth);
        println!(
            "{:2} … {:2}   {masked:11.3}   {band:14.3}",
            edges[0],
            edges[1] - 1
        );
        // 200 fields leave 5 % of scatter in the lowest band.
        assert!((band - 1.0).abs() < 0.15);
    }
    Ok(())
}
