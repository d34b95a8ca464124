//! σ of shapes with known normals, by evidence with nothing learned.

use lobes::glam::DVec3;
use lobes::illumination::EnvironmentMap;
use lobes::inference::{EvidenceReader, ReflectanceGrid, natural_spectrum};
use lobes::picture::{Circle, Picture, ShapeBall};
use lobes::reflectance::{Material, Variant};
use lobes::reflection::{Camera, Renderer, Settings, SphereImage, Viewpoint};
use lobes::{Parallelism, Result};

use crate::known_shapes::{Shape, ellipsoid, hills, normals, shaded, superquadric, torus};

/// By how much σ is off, |σ̂/σ − 1|, of each picture.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ShapeRoughness {
    /// Of balls, photographed as the shapes are.
    pub balls: Vec<f64>,
    /// Of an ellipsoid, a superquadric and a torus.
    pub shapes: Vec<f64>,
    /// Of hills, which have normals to 42° only.
    pub parts: Vec<f64>,
}

/// What a large picture of a ball shows at a normal, between its pixels.
fn at(ball: &SphereImage, normal: DVec3) -> [f64; 3] {
    let size = ball.size() as f64;
    // Within the rim, where every neighbour shows the ball.
    let limit = (size - 4.0) / size;
    let scale = (limit / normal.x.hypot(normal.y)).min(1.0);
    let (x, y) = (normal.x * scale, normal.y * scale);
    let (x, y) = (0.5 * (1.0 + x) * size - 0.5, 0.5 * (1.0 - y) * size - 0.5);
    let (column, row) = (x as usize, y as usize);
    let (u, v) = (x.fract(), y.fract());
    let value = |row, column| ball.get(row, column).unwrap_or_default();
    let corners = [
        (value(row, column), (1.0 - u) * (1.0 - v)),
        (value(row, column + 1), u * (1.0 - v)),
        (value(row + 1, column), (1.0 - u) * v),
        (value(row + 1, column + 1), u * v),
    ];
    [0, 1, 2].map(|c| corners.iter().map(|(rgb, w)| rgb[c] * w).sum())
}

/// Reads σ of shapes, and of a ball under the same light: σ = 0.05, 0.1 and 0.2, share ½, under each
/// of the maps.
///
/// # Errors
/// What the renderer and the readers refuse.
pub fn shape_roughness(
    maps: &[EnvironmentMap],
    parallelism: Parallelism,
    done: &(dyn Fn() + Sync),
) -> Result<ShapeRoughness> {
    let lobe = Variant::RadianceSampled;
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y)?;
    let shares: Vec<f64> = (1..8).map(|i| f64::from(i) / 8.0).collect();
    let sigmas: Vec<f64> = (0..14).map(|i| 0.02 * 1.22f64.powi(i)).collect();
    let spectra = [natural_spectrum(0.4, 127)];
    let reading_by = |reader: EvidenceReader, noise: f64| -> Result<_> {
        let layout = reader.layout();
        let grid =
            ReflectanceGrid::new(lobe, layout, &shares, &sigmas, &spectra, noise, parallelism)?;
        Ok((reader, grid))
    };
    let whole = EvidenceReader::new(Viewpoint::Orthographic)?;
    let whole = reading_by(whole, ShapeBall::NOISE)?;
    let part = EvidenceReader::within(Viewpoint::Orthographic, 0.6)?;
    let part = reading_by(part, ShapeBall::NOISE_OF_PART)?;
    let settings = Settings {
        size: SIZE,
        ..Settings::default()
    };
    let middle = 0.5 * SIZE as f64;
    let circle = Circle {
        x: middle,
        y: middle,
        radius: middle,
    };
    let one = Parallelism::Sequential;
    let of_maps = parallelism.map(maps.len(), |index| {
        let renderer = Renderer::new(&maps[index], one)?;
        let mut found = ShapeRoughness::default();
        for sigma in [0.05, 0.1, 0.2] {
            let material = Material::from_albedos("satin", [0.3; 3], [0.3; 3], sigma)?;
            let ball = renderer
                .render(&material, lobe, &camera, &settings, one)?
                .image;
            let off = |(reader, grid): &(EvidenceReader, ReflectanceGrid), image: &SphereImage| {
                let reading = reader.read(image)?;
                let posterior = grid.posterior(&reading.luminance, &reading.lights, WEIGHT)?;
                Ok((posterior.sigma_quantile(0.5) / sigma - 1.0).abs())
            };
            let pixels = (0..SIZE * SIZE).map(|i| ball.get(i / SIZE, i % SIZE).unwrap_or_default());
            let photographed = Picture::linear(SIZE, SIZE, pixels.collect())?;
            let cut = photographed.sphere(circle)?.image;
            found.balls.push(off(&whole, &cut)?);
            for shape in [ellipsoid as Shape, superquadric, torus, hills] {
                let picture = shaded(shape, |normal| at(&ball, normal))?;
                let made = normals(shape)?.ball(&picture)?;
                let image = made.picture.sphere(made.circle)?.image;
                if made.reach >= ShapeBall::WHOLE {
                    found.shapes.push(off(&whole, &image)?);
                } else {
                    found.parts.push(off(&part, &image)?);
                }
            }
        }
        done();
        Ok(found)
    });
    let mut all = ShapeRoughness::default();
    for of_map in of_maps {
        let of_map: ShapeRoughness = of_map?;
        all.balls.extend(of_map.balls);
        all.shapes.extend(of_map.shapes);
        all.parts.extend(of_map.parts);
    }
    Ok(all)
}

/// Pixels a side of the rendered balls.
const SIZE: usize = 256;

/// The power to which the evidence is raised.
const WEIGHT: f64 = 0.01;
