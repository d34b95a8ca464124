//! What single precision costs a transform: the error of `SingleTransform` against `Transform`, as a
//! part of the root mean square of the result, and how much memory the plans keep.
//!
//! ```text
//! cargo run --release -p lobes-experiments --example single_precision
//! ```
//!
//! Coefficients of a normal distribution (Pcg64, seed 1), Gauss–Legendre grids; analysis is of the map that
//! double precision makes of them, rounded. Both take the same values, which single precision holds.

use lobes::Result;
use lobes::harmonics::{Coefficients, SingleTransform, Transform};
use lobes::sphere::Grid;
use rand::RngExt;
use rand_pcg::Pcg64;

/// The root mean square and the largest of the errors, as parts of the root mean square.
fn errors(got: &[f32], want: &[f64]) -> [f64; 2] {
    let (mut squares, mut sum, mut largest) = (0.0, 0.0, 0f64);
    for (&got, &want) in got.iter().zip(want) {
        let difference = f64::from(got) - want;
        squares += want * want;
        sum += difference * difference;
        largest = largest.max(difference.abs());
    }
    let count = want.len() as f64;
    [(sum / squares).sqrt(), largest / (squares / count).sqrt()]
}

fn main() -> Result<()> {
    println!(
        "| degree | synthesis: rms | largest | analysis: rms | largest | MB of the plan | in double |"
    );
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    for degree in [63, 127, 255, 511, 1023, 2047, 4095] {
        let grid = Grid::gauss_legendre(degree + 1, 2 * degree + 2)?;
        let double = Transform::new(&grid, degree)?;
        let single = SingleTransform::new(&grid, degree)?;
        let mut random = Pcg64::new(1, 0);
        let set: Vec<f32> = (0..single.coefficient_count())
            .map(|_| (0..12).map(|_| random.random::<f32>()).sum::<f32>() - 6.0)
            .collect();
        let exact = set.iter().map(|&value| f64::from(value)).collect();
        let exact = double.synthesise(&Coefficients::from_vec(degree, degree, exact)?)?;
        let synthesis = errors(&single.synthesise(&set)?, &exact);
        let map: Vec<f32> = exact.iter().map(|&value| value as f32).collect();
        let rounded: Vec<f64> = map.iter().map(|&value| f64::from(value)).collect();
        let analysis = errors(&single.analyse(&map)?, double.analyse(&rounded)?.as_slice());
        let megabytes = |bytes: usize| bytes as f64 / 1e6;
        println!(
            "| {degree} | {:.1e} | {:.1e} | {:.1e} | {:.1e} | {:.1} | {:.1} |",
            synthesis[0],
            synthesis[1],
            analysis[0],
            analysis[1],
            megabytes(single.table_bytes()),
            megabytes(double.table_bytes()),
        );
    }
    Ok(())
}
