//! Contracts of `sphere`.

use super::{Contract, Metric, Oracle, Snapshots, Tally};
use lobes::Result;
use lobes::glam::{DMat3, DVec3};
use lobes::sphere::Frame;

pub(super) fn contracts() -> Vec<Contract> {
    vec![Contract {
        id: "sphere/frame-about",
        function: "sphere::Frame::about",
        oracle: Oracle::Identity("F Fᵀ = 1 and det F = +1"),
        domain: "10⁴ directions over the sphere, both poles, the seam at −z",
        metric: Metric::Absolute,
        bound: 4.0 * f64::EPSILON,
        why: "each entry is a sum of at most three products of rounded numbers below 1",
        loose: None,
        measure: frame_about,
    }]
}

fn frame_about(_: &Snapshots, tally: &mut Tally) -> Result<()> {
    let poles = [1.0, -1.0].map(|z| DVec3::new(0.0, 0.0, z));
    let seam = [1e-3, 1e-8, 1e-16].map(|x| DVec3::new(x, -x, -1.0).normalize());
    let spiral = (0..10_000).map(|i| {
        let z: f64 = 1.0 - (2.0 * f64::from(i) + 1.0) / 10_000.0;
        let azimuth = 2.399_963_229_728_653 * f64::from(i);
        let sine = (1.0 - z * z).sqrt();
        DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), z).normalize()
    });
    for z in poles.into_iter().chain(seam).chain(spiral) {
        let frame = Frame::about(z);
        let matrix = DMat3::from_cols(frame.x, frame.y, frame.z);
        let product = matrix * matrix.transpose();
        let identity = DMat3::IDENTITY;
        for (got, want) in product.to_cols_array().iter().zip(identity.to_cols_array()) {
            tally.compare(*got, want, || format!("z = {z}"));
        }
        tally.compare(matrix.determinant(), 1.0, || {
            format!("determinant at z = {z}")
        });
    }
    Ok(())
}
