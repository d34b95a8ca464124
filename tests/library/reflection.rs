//! Cameras and the renderer against what is known in closed form.

use lobes::glam::DVec3;
use lobes::illumination::EnvironmentMap;
use lobes::reflectance::{Material, Variant, Ward};
use lobes::reflection::{Camera, Renderer, Settings, ShadingPoint};
use lobes::{Error, Parallelism};

fn grey(height: usize) -> EnvironmentMap {
    EnvironmentMap::new(
        "grey",
        2 * height,
        height,
        vec![[0.5, 1.0, 2.0]; 2 * height * height],
    )
    .unwrap()
}

/// A map of soft waves, a checkerboard and a lamp of one pixel.
fn varied(height: usize, lamp: f64) -> EnvironmentMap {
    let width = 2 * height;
    let mut pixels: Vec<[f64; 3]> = (0..width * height)
        .map(|index| {
            let (row, column) = (index / width, index % width);
            let board = f64::from(u8::from(
                (8 * row / height + 8 * column / width).is_multiple_of(2),
            ));
            let wave = 1.0 + (6.0 * row as f64 / height as f64).sin() * 0.9;
            [wave + board, wave, 0.3 + board]
        })
        .collect();
    pixels[height / 4 * width + width / 3] = [lamp; 3];
    EnvironmentMap::new("varied", width, height, pixels).unwrap()
}

fn level() -> Camera {
    Camera::orthographic(DVec3::Z, DVec3::Y).unwrap()
}

#[test]
fn the_sphere_touches_the_border_and_is_seen_along_the_rays() {
    for camera in [
        Camera::orthographic(DVec3::new(1.0, 2.0, -0.5), DVec3::Y).unwrap(),
        Camera::perspective(DVec3::new(-1.0, 0.2, 0.3), DVec3::X, 1.5).unwrap(),
        Camera::filling(DVec3::new(-1.0, 0.2, 0.3), DVec3::X, 0.7)
            .unwrap()
            .rolled(1.0),
    ] {
        for (x, y) in [
            (0.0f64, 0.0f64),
            (0.9999999, 0.0),
            (-0.3, 0.6),
            (0.0, -0.99),
        ] {
            let ShadingPoint { normal, view } = camera.point(x, y).unwrap();
            assert!((normal.length() - 1.0).abs() < 1e-15 && (view.length() - 1.0).abs() < 1e-15);
            let polar = normal.dot(camera.towards()).acos();
            let azimuth = normal.dot(camera.up()).atan2(normal.dot(camera.right()));
            let again = camera.shading_point(polar, azimuth);
            assert!((again.view - view).length() < 1e-7, "{x} {y}");
            assert!((again.normal - normal).length() < 1e-7, "{x} {y}");
            assert!((y.atan2(x) - azimuth).abs() < 1e-6 || x.hypot(y) < 1e-9);
            if x > 0.9 {
                assert!(normal.dot(view).abs() < 1e-3 && (polar - camera.rim()).abs() < 1e-3);
            }
        }
        assert!(camera.point(1.0, 0.0).is_none());
        assert!(camera.point(f64::NAN, 0.0).is_none());
    }
}

#[test]
fn bad_cameras_are_refused() {
    let refused = |result: lobes::Result<Camera>| matches!(result, Err(Error::Domain { .. }));
    assert!(refused(Camera::orthographic(DVec3::Y, DVec3::Y)));
    assert!(refused(Camera::orthographic(DVec3::ZERO, DVec3::Y)));
    assert!(refused(Camera::orthographic(DVec3::Z, DVec3::NAN)));
    assert!(refused(Camera::perspective(DVec3::Z, DVec3::Y, 1.0)));
    assert!(refused(Camera::perspective(DVec3::Z, DVec3::Y, f64::NAN)));
    assert!(refused(Camera::filling(DVec3::Z, DVec3::Y, 0.0)));
}

#[test]
fn bad_settings_are_refused() {
    let renderer = Renderer::new(&grey(8), Parallelism::Sequential).unwrap();
    let with = |settings: Settings| {
        renderer.render(
            &Material::white(),
            Variant::Duer,
            &level(),
            &settings,
            Parallelism::Sequential,
        )
    };
    for settings in [
        Settings {
            size: 0,
            ..Settings::default()
        },
        Settings {
            tolerance: 0.0,
            ..Settings::default()
        },
        Settings {
            tolerance: f64::NAN,
            ..Settings::default()
        },
        Settings {
            pixel_samples: 0,
            ..Settings::default()
        },
    ] {
        assert!(matches!(with(settings), Err(Error::Domain { .. })));
    }
}

#[test]
fn a_mirror_shows_the_map() {
    let map = varied(32, 50.0);
    let renderer = Renderer::new(&map, Parallelism::Sequential).unwrap();
    let mirror = Material::metal("mirror", [1.0, 0.5, 0.25], 1.0, 0.0).unwrap();
    let camera = Camera::perspective(DVec3::new(0.2, 0.5, 1.0), DVec3::Y, 3.0).unwrap();
    let settings = Settings {
        size: 33,
        ..Settings::default()
    };
    let rendering = renderer
        .render(
            &mirror,
            Variant::Duer,
            &camera,
            &settings,
            Parallelism::Sequential,
        )
        .unwrap();
    assert!(rendering.error < 1e-12);
    assert!(rendering.image.count() > 800);
    for (row, column, pixel) in rendering.image.iter() {
        let ShadingPoint { normal, view } = camera.pixel(33, row, column).unwrap();
        let seen = map.radiance(2.0 * normal.dot(view) * normal - view);
        for channel in 0..3 {
            let expected = seen[channel] * mirror.specular()[channel];
            assert!((pixel[channel] - expected).abs() <= 1e-13 * (1.0 + expected));
        }
    }
}

#[test]
fn in_a_furnace_each_pixel_is_the_albedo() {
    let renderer = Renderer::new(&grey(32), Parallelism::Sequential).unwrap();
    let settings = Settings {
        size: 16,
        ..Settings::default()
    };
    for variant in Variant::ALL {
        for sigma in [0.02, 0.1, 0.3] {
            let material = Material::from_albedos("grey", [0.25; 3], [0.5; 3], sigma).unwrap();
            let lobe = Ward::isotropic(variant, sigma).unwrap();
            let rendering = renderer
                .render(
                    &material,
                    variant,
                    &level(),
                    &settings,
                    Parallelism::Sequential,
                )
                .unwrap();
            for (row, column, pixel) in rendering.image.iter() {
                let point = level().pixel(16, row, column).unwrap();
                let expected = 0.25 + 0.5 * lobe.albedo(point.normal.dot(point.view));
                assert!(
                    (pixel[1] - expected).abs() < 2e-3 * expected,
                    "{variant} σ {sigma} ({row}, {column}): {} for {expected}",
                    pixel[1]
                );
            }
        }
    }
}
