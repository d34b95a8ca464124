//! Spectra from part of a sphere: the coupling matrix against closed forms and its own meaning, and what each way of filling the hidden
//! hemisphere does to the spectrum of random fields.

use std::f64::consts::PI;

use lobes::harmonics::{Coefficients, Coupling, Mask, Transform, average_power};
use lobes::sphere::Grid;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const HEMISPHERE: Mask = Mask::Cap { radius: PI / 2.0 };

/// A normal deviate (Box and Muller).
fn normal(generator: &mut Pcg64) -> f64 {
    let (u, v): (f64, f64) = (generator.random(), generator.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (2.0 * PI * v).cos()
}

fn field(power: &[f64], generator: &mut Pcg64) -> Coefficients {
    let degree = power.len() - 1;
    let mut f = Coefficients::zeros(degree);
    for l in 0..=degree {
        for m in -(l as isize)..=l as isize {
            f.set(l, m, power[l].sqrt() * normal(generator));
        }
    }
    f
}

#[test]
fn coupling_of_the_hemisphere_by_hand() {
    let coupling = Coupling::new(HEMISPHERE, 4).unwrap();
    let m = coupling.matrix();
    // w_00² = π, w_10² = 3π/4, w_20 = 0, w_30² = 7π/64: M_00 = ¼, M_01 = w_10²/4π, M_10 = M_01/3, M_03 = w_30²/4π.
    for ((l, k), truth) in [
        ((0, 0), 0.25),
        ((0, 1), 3.0 / 16.0),
        ((1, 0), 1.0 / 16.0),
        ((0, 2), 0.0),
        ((0, 3), 7.0 / 256.0),
        ((1, 1), 0.25),
        (
            (2, 1),
            3.0 / 4.0 * (3.0 / 16.0 * 2.0 / 15.0 + 7.0 / 256.0 * 3.0 / 35.0) * 4.0,
        ),
    ] {
        assert!(
            (m[(l, k)] - truth).abs() < 1e-15,
            "M_{l}{k}: {} for {truth}",
            m[(l, k)]
        );
    }
    // A field of all degrees of power 1 has the power of the mask's square everywhere: Σ_l′ M_ll′ = ½ as degrees grow.
    let coupling = Coupling::new(HEMISPHERE, 400).unwrap();
    let row: f64 = coupling.matrix().row(100).iter().sum();
    assert!((row - 0.5).abs() < 1e-3, "{row}");
}

#[test]
fn bad_masks_and_bands() {
    assert!(Coupling::new(Mask::Cap { radius: 4.0 }, 4).is_err());
    assert!(
        Coupling::new(
            Mask::Apodised {
                inner: 1.0,
                outer: 0.5
            },
            4
        )
        .is_err()
    );
    assert!(Coupling::new(Mask::Cap { radius: f64::NAN }, 4).is_err());
    assert!(Coupling::new(HEMISPHERE, 1024 + 1).is_err());
    let coupling = Coupling::new(HEMISPHERE, 8).unwrap();
    assert!(coupling.decouple(&[1.0; 8], &[0, 4, 9], |_| 1.0).is_err());
    assert!(coupling.decouple(&[1.0; 9], &[0, 4, 10], |_| 1.0).is_err());
    assert!(coupling.decouple(&[1.0; 9], &[4, 4], |_| 1.0).is_err());
    assert!(coupling.decouple(&[1.0; 9], &[0, 4, 9], |_| 1.0).is_ok());
}

/// Mean of the estimated over the true power in bands, and its standard error, for 600 Gaussian fields of power (l+1)^−2.3, l ≤ 40, seed 11.
/// `cargo test --test harmonics_partial -- --nocapture` prints the table.
#[test]
fn only_decoupling_is_unbiased() {
    const FIELDS: usize = 600;
    let edges = [0, 2, 4, 8, 16, 32, 41];
    let bands = edges.len() - 1;
    let shape = |l: usize| (l as f64 + 1.0).powf(-2.3);
    let truth: Vec<f64> = (0..=40).map(shape).collect();
    let grid = Grid::gauss_legendre(96, 192).unwrap();
    let synthesis = Transform::new(&grid, 40).unwrap();
    let analysis = Transform::new(&grid, 80).unwrap();
    let soft = Mask::Apodised {
        inner: 1.1,
        outer: PI / 2.0,
    };
    let couplings = [HEMISPHERE, soft].map(|mask| (mask, Coupling::new(mask, 40).unwrap()));
    let band_mean = |power: &[f64], band: usize| {
        let (mut sum, mut weight) = (0.0, 0.0);
        for l in edges[band]..edges[band + 1] {
            sum += (2 * l + 1) as f64 * power[l] / truth[l];
            weight += (2 * l + 1) as f64;
        }
        sum / weight
    };
    let names = [
        "mirror",
        "half-turn",
        "zero",
        "decoupled",
        "decoupled, soft edge",
    ];
    let mut moments = vec![vec![(0.0, 0.0); bands]; names.len()];
    let mut generator = Pcg64::seed_from_u64(11);
    for _ in 0..FIELDS {
        let map = synthesis
            .synthesise(&field(&truth, &mut generator))
            .unwrap();
        let (rings, columns) = (grid.rings(), grid.columns());
        let filled = |back: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
            let mut full = map.clone();
            for ring in rings / 2..rings {
                for column in 0..columns {
                    full[ring * columns + column] = back(rings - 1 - ring, column);
                }
            }
            average_power(&analysis.analyse(&full).unwrap())
        };
        let at = |ring: usize, column: usize| map[ring * columns + column];
        let mut estimates = vec![
            filled(&|ring, column| at(ring, column)),
            filled(&|ring, column| at(ring, (columns + columns / 2 - column) % columns)),
            filled(&|_, _| 0.0).iter().map(|p| 2.0 * p).collect(), // half the sphere, twice the power
        ];
        let direct = estimates
            .iter()
            .map(|p| (0..bands).map(|b| band_mean(p, b)).collect())
            .collect::<Vec<Vec<f64>>>();
        estimates.clear();
        let decoupled = couplings.iter().map(|(mask, coupling)| {
            let mut masked = map.clone();
            mask.apply(&grid, &mut masked).unwrap();
            let pseudo = average_power(&analysis.analyse(&masked).unwrap());
            coupling.decouple(&pseudo[..41], &edges, shape).unwrap()
        });
        for (moments, bands) in moments.iter_mut().zip(direct.into_iter().chain(decoupled)) {
            for ((sum, square), value) in moments.iter_mut().zip(bands) {
                *sum += value;
                *square += value * value;
            }
        }
    }
    let n = FIELDS as f64;
    for (name, moments) in names.iter().zip(&moments) {
        print!("{name:20}");
        let mut farthest: f64 = 0.0;
        for (sum, square) in moments {
            let mean = sum / n;
            let error = ((square / n - mean * mean) / (n - 1.0)).sqrt();
            print!("  {mean:.3} ± {error:.3}");
            farthest = farthest.max((mean - 1.0).abs() / error);
        }
        println!();
        // Six looks: 4 standard errors come by chance once in 2600 times.
        assert_eq!(
            name.starts_with("decoupled"),
            farthest < 4.0,
            "{name}: {farthest}"
        );
    }
}
