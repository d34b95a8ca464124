//! How rough is a sphere, from one picture under light that nobody measured, with nothing learned?
//!
//! The evidence needs what is known of light (its power falls as l^(−2−η), and there are lamps) and
//! of Ward's lobe, and no training picture, no exposure and no white sphere. It reads the roughness
//! σ. How large the specular share is, it does not know: that light is never negative is not in it
//! (docs/explanation/inference.md).

use lobes::Parallelism::Rayon;
use lobes::glam::DVec3;
use lobes::illumination::builtin;
use lobes::inference::{EvidenceReader, GaussianEvidence, ReflectanceGrid, natural_spectrum};
use lobes::reflectance::{Material, Variant};
use lobes::reflection::{Camera, Renderer, Settings, Viewpoint};

/// Of light that is taken into account.
const DEGREE: usize = 127;

/// To what power likelihoods are raised: amplitudes of real light are not as independent as a
/// field's, and each in full would be far too sure. Chosen by hand; `lobes reproduce --protocol
/// continuous` has it found by an inner loop.
const WEIGHT: f64 = 0.01;

fn main() -> lobes::Result<()> {
    let reader = EvidenceReader::new(Viewpoint::Orthographic)?;
    let shares: Vec<f64> = (1..8).map(|i| f64::from(i) / 8.0).collect();
    let sigmas: Vec<f64> = (0..12).map(|i| 0.02 * 1.26f64.powi(i)).collect();
    let spectra = [natural_spectrum(0.4, DEGREE)];
    let (lobe, noise) = (Variant::RadianceSampled, GaussianEvidence::NOISE);
    // Made once, for any number of pictures by cameras as far away.
    let grid = ReflectanceGrid::new(
        lobe,
        reader.layout(),
        &shares,
        &sigmas,
        &spectra,
        noise,
        Rayon,
    )?;

    let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
    for light in builtin()?.iter().skip(1).step_by(6) {
        let renderer = Renderer::new(light, Rayon)?;
        for sigma in [0.03, 0.1] {
            let material = Material::from_albedos("satin", [0.3; 3], [0.3; 3], sigma)?;
            let settings = Settings::default();
            let image = renderer
                .render(&material, lobe, &camera, &settings, Rayon)?
                .image;

            let picture = reader.read(&image)?;
            let posterior = grid.posterior(&picture.luminance, &picture.lights, WEIGHT)?;
            let [low, middle, high] =
                [0.05, 0.5, 0.95].map(|level| posterior.sigma_quantile(level));
            let name = light.name();
            println!("{name}: σ {middle:.3}, with 90 % from {low:.3} to {high:.3}; it is {sigma}");
            assert!((0.5..2.0).contains(&(middle / sigma)));
        }
    }
    Ok(())
}
