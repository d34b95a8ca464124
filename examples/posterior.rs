//! What does one picture of a sphere say of its reflectance, under light that nobody measured?
//!
//! A model that has seen spheres under other light answers with a posterior: how probable each
//! roughness σ and each specular share `ρ_s / (ρ_s + ρ_d)` is. It learns here from four of the
//! seventeen built-in maps and two cameras, which takes seconds; all of both, as `lobes classify`
//! has them, take a minute and give narrower answers (docs/explanation/inference.md).

use lobes::Parallelism::Rayon;
use lobes::glam::DVec3;
use lobes::illumination::{EnvironmentMap, builtin};
use lobes::inference::{Model, Training, TrainingPlan};
use lobes::picture::{Circle, Picture};
use lobes::reflectance::{Material, Variant, presets};
use lobes::reflection::{Camera, Renderer, Settings};

/// Pixels a side.
const SIZE: usize = 96;

fn main() -> lobes::Result<()> {
    let lights = builtin()?;
    let mut plan = TrainingPlan::default();
    plan.plan.turns = 2;
    let training = Training::new(&lights[..4], &presets(), &plan, Rayon, &|| ())?;
    let model = Model::learn(&training, Rayon)?;

    // Linear pixels, row by row from the top: of a sphere of σ = 0.1, half of whose albedo is
    // specular, under light that the model has not seen.
    let (sigma, share) = (0.1, 0.5);
    let pixels = pixels(&lights[6], sigma, share)?;

    // Where the sphere is, is known here; `Picture::circle` finds it.
    let picture = Picture::linear(SIZE, SIZE, pixels)?;
    let half = SIZE as f64 / 2.0;
    let sphere = picture.sphere(Circle {
        x: half,
        y: half,
        radius: half,
    })?;
    let posterior = model.read(&sphere)?.posterior;

    let [low, middle, high] = [0.05, 0.5, 0.95].map(|level| posterior.sigma_quantile(level));
    println!("σ {middle:.3}, with 90 % from {low:.3} to {high:.3}; it is {sigma}");
    assert!(low < middle && middle < high);
    let [low, middle, high] = [0.05, 0.5, 0.95].map(|level| posterior.share_quantile(level));
    println!("share {middle:.2}, with 90 % from {low:.2} to {high:.2}; it is {share}");
    assert!(low < middle && middle < high);

    // A row a roughness, a column a share; all of it is 1.
    let (shares, sigmas) = (posterior.shares(), posterior.sigmas());
    assert_eq!(posterior.probabilities().len(), shares.len() * sigmas.len());
    assert!((posterior.probabilities().iter().sum::<f64>() - 1.0).abs() < 1e-12);
    // It knows a satin surface from a mirror and from a wall.
    assert!(
        posterior.sigma_quantile(0.5) > sigma / 2.0 && posterior.sigma_quantile(0.5) < sigma * 2.0
    );
    Ok(())
}

/// A sphere under a light, rendered; black around it.
fn pixels(light: &EnvironmentMap, sigma: f64, share: f64) -> lobes::Result<Vec<[f64; 3]>> {
    let (diffuse, specular) = ([0.6 * (1.0 - share); 3], [0.6 * share; 3]);
    let material = Material::from_albedos("satin", diffuse, specular, sigma)?;
    let settings = Settings {
        size: SIZE,
        tolerance: 1e-2,
        ..Settings::default()
    };
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
    let image = Renderer::new(light, Rayon)?
        .render(
            &material,
            Variant::RadianceSampled,
            &camera,
            &settings,
            Rayon,
        )?
        .image;
    Ok((0..SIZE * SIZE)
        .map(|i| image.get(i / SIZE, i % SIZE).unwrap_or_default())
        .collect())
}
