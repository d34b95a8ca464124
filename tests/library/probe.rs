//! Light from photographs of a mirror ball that the tests make by tracing rays.

use lobes::glam::DVec3;
use lobes::illumination::{EnvironmentMap, builtin};
use lobes::picture::{Circle, Picture};
use lobes::probe::{Bracket, MirrorBall, ProbeMap, Radiance, merge, refine, restore_sun};
use lobes::{Error, Parallelism};

const ONE: Parallelism = Parallelism::Rayon;

const CIRCLE: Circle = Circle {
    x: 141.0,
    y: 138.5,
    radius: 110.0,
};

fn map(name: &str) -> EnvironmentMap {
    let maps = builtin().unwrap();
    maps.into_iter().find(|map| map.name() == name).unwrap()
}

/// What a camera at `distance` radii sees of the unit ball, which mirrors `share` of the light or
/// is matte, and of the map behind it: rays, and nothing of the unwrapping.
fn trace(
    width: usize,
    circle: Circle,
    distance: f64,
    behind: impl Fn(DVec3) -> [f64; 3] + Sync + Send,
    ball: impl Fn(DVec3, DVec3) -> [f64; 3] + Sync + Send,
) -> Vec<[f64; 3]> {
    let focal = circle.radius * (distance * distance - 1.0).sqrt();
    const SAMPLES: usize = 3;
    ONE.map(width * width, |i| {
        let mut sum = [0.0; 3];
        for k in 0..SAMPLES * SAMPLES {
            let part = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
            let x = (i % width) as f64 + part(k % SAMPLES);
            let y = (i / width) as f64 + part(k / SAMPLES);
            let ray = DVec3::new((x - circle.x) / focal, (circle.y - y) / focal, -1.0).normalize();
            let origin = DVec3::new(0.0, 0.0, distance);
            let half = origin.dot(ray);
            let root = half * half - (distance * distance - 1.0);
            let value = if root > 0.0 {
                let normal = origin + ray * (-half - root.sqrt());
                ball(normal, ray - 2.0 * ray.dot(normal) * normal)
            } else {
                behind(ray)
            };
            sum = std::array::from_fn(|c| sum[c] + value[c] / (SAMPLES * SAMPLES) as f64);
        }
        sum
    })
}

fn mirror(map: &EnvironmentMap, distance: f64, share: f64) -> Vec<[f64; 3]> {
    let seen = |light: DVec3| map.radiance(light).map(|value| share * value);
    trace(
        280,
        CIRCLE,
        distance,
        |ray| map.radiance(ray),
        |_, light| seen(light),
    )
}

fn radiance(pixels: Vec<[f64; 3]>) -> Radiance {
    Radiance {
        width: 280,
        height: 280,
        clipped: vec![false; pixels.len()],
        pixels,
        exposures: vec![1.0],
    }
}

fn ball(distance: Option<f64>) -> MirrorBall {
    MirrorBall {
        circle: CIRCLE,
        distance,
        reflectance: [0.7; 3],
        photographer: 0.0,
    }
}

/// Directions mirrored at normals of the ball are found again, to the blind cone and no farther.
#[test]
fn the_mapping_is_exact_at_any_distance() {
    for distance in [1.5, 5.0, 50.0] {
        let ball = ball(Some(distance));
        let rim = (1.0f64 / distance).acos();
        for step in 0..=40 {
            let theta = rim * f64::from(step) / 40.0;
            let normal = DVec3::new(theta.sin(), 0.0, theta.cos());
            let ray = (normal - DVec3::new(0.0, 0.0, distance)).normalize();
            let light = ray - 2.0 * ray.dot(normal) * normal;
            let polar = light.x.atan2(light.z).rem_euclid(std::f64::consts::TAU);
            let found = ball.normal_angle(polar - 1e-12).unwrap();
            assert!(
                (found - theta).abs() < 1e-6,
                "{distance}: {found} for {theta}"
            );
        }
        let blind = std::f64::consts::PI - (1.0f64 / distance).asin();
        assert!(ball.normal_angle(blind + 1e-9).is_none());
        assert!(ball.normal_angle(blind - 1e-9).is_some());
    }
    // Far away it is half the angle.
    assert_eq!(ball(None).normal_angle(1.0), Some(0.5));
}

/// The root mean square difference of the pixels' means over directions that were seen, relative.
fn apart(truth: &EnvironmentMap, probe: &ProbeMap) -> f64 {
    let (mut apart, mut all) = (0.0, 0.0);
    for (index, pixel) in probe.pixels.iter().enumerate() {
        let direction = probe.direction(index);
        if probe.alpha[index] < 0.99 || direction.z < -0.9 {
            continue;
        }
        let area = direction.x.hypot(direction.z);
        // The mean of the truth over the pixel.
        let (rows, columns) = (probe.rows, 2 * probe.rows);
        let mut light = [0.0; 3];
        for sample in 0..64 {
            let part = |k: usize| (k as f64 + 0.5) / 8.0;
            let v = ((index / columns) as f64 + part(sample / 8)) / rows as f64;
            let u = ((index % columns) as f64 + part(sample % 8)) / columns as f64;
            let at = lobes::sphere::Mapping::LatLong.direction(u, v).unwrap();
            let value = truth.radiance(at);
            light = std::array::from_fn(|c| light[c] + value[c] / 64.0);
        }
        for c in 0..3 {
            apart += area * (pixel[c] - light[c]).powi(2);
            all += area * light[c] * light[c];
        }
    }
    f64::sqrt(apart / all)
}

/// A ball of five radii away comes back as the map; taken for one that is far, it does not.
#[test]
fn a_near_ball_is_unwrapped_to_the_map() {
    let truth = map("pmndrs-apartment").resampled(64, 32).unwrap();
    for distance in [5.0, 20.0] {
        let picture = radiance(mirror(&truth, distance, 0.7));
        let exact = ball(Some(distance))
            .unwrap(&picture, None, 32, ONE)
            .unwrap();
        let far = ball(None).unwrap(&picture, None, 32, ONE).unwrap();
        let (exact, far) = (apart(&truth, &exact), apart(&truth, &far));
        assert!(
            exact < 0.08 && far > 1.5 * exact,
            "{distance}: {exact} {far}"
        );
    }
    // The blind cone and the photographer are transparent, and filled with something.
    let picture = radiance(mirror(&truth, 5.0, 0.7));
    let hiding = MirrorBall {
        photographer: 0.2,
        ..ball(Some(5.0))
    };
    let probe = hiding.unwrap(&picture, None, 64, ONE).unwrap();
    for (index, alpha) in probe.alpha.iter().enumerate() {
        let polar = probe.direction(index).z.acos();
        if !(0.15..std::f64::consts::PI - 0.19).contains(&polar) {
            assert_eq!(*alpha, 0.0, "{polar}");
            assert!(probe.pixels[index][1] > 0.0);
        }
        if (0.26..2.4).contains(&polar) {
            assert!(*alpha > 0.999, "{polar}: {alpha}");
        }
    }
    // What a mask hides is not read.
    let hidden: Vec<bool> = (0..280 * 280).map(|i| i % 280 < 141).collect();
    let probe = ball(Some(5.0))
        .unwrap(&picture, Some(&hidden), 32, ONE)
        .unwrap();
    let left = |index: usize| probe.direction(index).x < -0.1 && probe.alpha[index] > 0.0;
    assert!(!(0..probe.alpha.len()).any(left));
}

/// Two cameras a quarter of a turn apart: together they see what each alone does not.
#[test]
fn two_sides_make_one_map() {
    let truth = map("pmndrs-apartment").resampled(64, 32).unwrap();
    // The second camera stands at +x: its own frame is the first's turned.
    let turned = |light: DVec3| DVec3::new(light.z, light.y, -light.x);
    let seen = |light: DVec3| truth.radiance(turned(light)).map(|value| 0.35 * value);
    let second = trace(
        280,
        CIRCLE,
        6.0,
        |ray| truth.radiance(ray),
        |_, light| seen(light),
    );
    let first = radiance(mirror(&truth, 6.0, 0.7));
    let hiding = MirrorBall {
        photographer: 0.3,
        ..ball(Some(6.0))
    };
    let first = hiding.unwrap(&first, None, 32, ONE).unwrap();
    let second = hiding.unwrap(&radiance(second), None, 32, ONE).unwrap();
    let turn = 90f64.to_radians();
    let merged = merge(&first, &second, turn, false).unwrap();
    assert!(merged.alpha.iter().all(|alpha| *alpha > 0.5));
    assert!(apart(&truth, &merged) < 0.08, "{}", apart(&truth, &merged));
    let wrong = merge(&first, &second, -turn, false).unwrap();
    assert!(apart(&truth, &wrong) > 0.2);
    let other = hiding
        .unwrap(&radiance(mirror(&truth, 6.0, 0.7)), None, 16, ONE)
        .unwrap();
    assert!(matches!(
        merge(&first, &other, turn, false),
        Err(Error::OtherSize { .. })
    ));
}

/// Codes of 8 bits at an exposure, by sRGB's curve.
fn photograph(pixels: &[[f64; 3]], exposure: f64, shift: usize) -> Picture {
    let code = |value: f64| {
        let light = (exposure * value).clamp(0.0, 1.0);
        (255.0 * lobes::files::srgb_of_linear(light)).round() / 255.0
    };
    let at = |i: usize| pixels[(i / 280) * 280 + (i % 280 + shift).min(279)].map(code);
    Picture::encoded(280, 280, (0..pixels.len()).map(at).collect()).unwrap()
}

fn names(count: usize) -> Vec<String> {
    (0..count).map(|i| format!("{i}.png")).collect()
}

#[test]
fn a_bracket_is_one_picture_of_radiance() {
    let truth = mirror(&map("pmndrs-apartment"), 8.0, 0.7);
    let mean = truth.iter().map(|p| p[1]).sum::<f64>() / truth.len() as f64;
    let exposures = [0.3 / mean, 0.02 / mean, 0.08 / mean];
    let shots = |shift: usize| -> Vec<Picture> {
        let shot = |(i, e): (usize, &f64)| photograph(&truth, *e, if i == 0 { shift } else { 0 });
        exposures.iter().enumerate().map(shot).collect()
    };
    let bracket = Bracket::new(shots(0), names(3), vec![None; 3]).unwrap();
    let merged = bracket.merge(Some(CIRCLE)).unwrap();
    // The ratios are read off the pictures, and radiance is one factor off the truth.
    for (i, j) in [(0, 2), (2, 1)] {
        let ratio = merged.exposures[i] / merged.exposures[j];
        let expected = exposures[i] / exposures[j];
        assert!((ratio / expected - 1.0).abs() < 0.01, "{ratio} {expected}");
    }
    let scale = merged.exposures[1] / exposures[1];
    let mut errors: Vec<f64> = truth
        .iter()
        .zip(&merged.pixels)
        .zip(&merged.clipped)
        .filter(|(_, clipped)| !**clipped)
        .map(|((t, m), _)| (scale * m[1] / t[1] - 1.0).abs())
        .collect();
    errors.sort_by(f64::total_cmp);
    assert!(errors[errors.len() / 2] < 0.01 && errors[errors.len() * 95 / 100] < 0.05);
    // Moved by five pixels, it is refused, with about how much.
    let moved = Bracket::new(shots(5), names(3), vec![None; 3]).unwrap();
    match moved.merge(Some(CIRCLE)) {
        Err(Error::Moved {
            first,
            second,
            pixels,
        }) => {
            assert_eq!((first.as_str(), second.as_str()), ("2.png", "0.png"));
            assert!((2.5..8.0).contains(&pixels), "{pixels}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn exposures_that_nothing_tells_are_refused() {
    // Two pictures without a pixel in common that either shows well.
    let flat = |value: f64| Picture::encoded(280, 280, vec![[value; 3]; 280 * 280]).unwrap();
    let pictures = || vec![flat(0.01), flat(1.0)];
    let none = Bracket::new(pictures(), names(2), vec![None; 2]).unwrap();
    assert!(matches!(none.merge(None), Err(Error::NoRatio { .. })));
    let told = Bracket::new(pictures(), names(2), vec![Some(1.0), Some(64.0)]).unwrap();
    assert_eq!(told.merge(None).unwrap().exposures, [1.0, 64.0]);
    assert!(matches!(
        Bracket::new(Vec::new(), Vec::new(), Vec::new()),
        Err(Error::Empty { .. })
    ));
    let small = Picture::encoded(20, 20, vec![[0.5; 3]; 400]).unwrap();
    let sizes = Bracket::new(vec![flat(0.5), small], names(2), vec![None; 2]);
    assert!(matches!(sizes, Err(Error::OtherSize { .. })));
    let zero = Bracket::new(vec![flat(0.5)], names(1), vec![Some(0.0)]);
    assert!(matches!(zero, Err(Error::Domain { .. })));
}

/// A circle two per cent off is brought to a third of a per cent, before a wall.
#[test]
fn the_outline_is_refined() {
    let light = map("pmndrs-studio");
    let seen = |light_from: DVec3| light.radiance(light_from).map(|value| 0.6 * value);
    let wall = |ray: DVec3| [0.4 + 0.2 * (40.0 * ray.x).sin() * (55.0 * ray.y).cos(); 3];
    let picture = radiance(trace(280, CIRCLE, 10.0, wall, |_, light| seen(light)));
    let guess = Circle {
        x: CIRCLE.x + 1.5,
        y: CIRCLE.y - 1.0,
        radius: 1.02 * CIRCLE.radius,
    };
    let found = refine(&picture, guess);
    assert!(
        (found.radius / CIRCLE.radius - 1.0).abs() < 0.0035,
        "{found:?}"
    );
    assert!(
        (found.x - CIRCLE.x).hypot(found.y - CIRCLE.y) < 0.5,
        "{found:?}"
    );
}

/// A sun that was cut off to a fiftieth is put back by what it does to a matte ball.
#[test]
fn a_grey_ball_tells_the_sun() {
    let mut pixels = vec![[0.6, 0.7, 0.9]; 128 * 64];
    let sun = DVec3::new(0.4, 0.6, 0.7).normalize();
    let flat = EnvironmentMap::new("flat", 128, 64, pixels.clone()).unwrap();
    for row in 0..64 {
        for column in 0..128 {
            if flat.direction(row, column).dot(sun) > 6f64.to_radians().cos() {
                pixels[row * 128 + column] = [500.0, 450.0, 350.0];
            }
        }
    }
    let truth = EnvironmentMap::new("sun", 128, 64, pixels).unwrap();
    let mut seen = radiance(mirror(&truth, 10.0, 0.7));
    for (pixel, clipped) in seen.pixels.iter_mut().zip(&mut seen.clipped) {
        *clipped = pixel.iter().any(|value| *value > 6.0);
        *pixel = pixel.map(|value| value.min(7.0));
    }
    // The matte ball by a sum over the map's pixels.
    let parts: Vec<(DVec3, [f64; 3])> = (0..128 * 64)
        .map(|i| {
            let (row, column) = (i / 128, i % 128);
            let area = truth.solid_angle(row);
            (
                truth.direction(row, column),
                truth.pixel(row, column).map(|v| area * v),
            )
        })
        .collect();
    let matte = |normal: DVec3, _| {
        let mut sum = [0.0; 3];
        for (direction, light) in &parts {
            let cosine = direction.dot(normal).max(0.0);
            sum = std::array::from_fn(|c| sum[c] + 0.18 / std::f64::consts::PI * cosine * light[c]);
        }
        sum
    };
    let grey_circle = Circle {
        x: 25.0,
        y: 25.0,
        radius: 20.0,
    };
    let mut grey = radiance(vec![[0.0; 3]; 280 * 280]);
    let small = trace(50, grey_circle, 10.0, |_| [0.0; 3], matte);
    for (i, pixel) in small.into_iter().enumerate() {
        grey.pixels[i / 50 * 280 + i % 50] = pixel;
    }
    let cut = ball(Some(10.0)).unwrap(&seen, None, 64, ONE).unwrap();
    let irradiance = |map: &ProbeMap| {
        let map = map.environment("probe").unwrap();
        lobes::evaluation::LightErrors::between(&truth, &map, ONE)
            .unwrap()
            .irradiance
    };
    assert!(irradiance(&cut) > 0.5);
    for albedo in [Some(0.18), None] {
        let (restored, raised) =
            restore_sun(&cut, &grey, grey_circle, Some(10.0), albedo, ONE).unwrap();
        assert!(raised[0] > raised[1] && raised[1] > raised[2], "{raised:?}");
        assert!(
            irradiance(&restored) < 0.03,
            "{albedo:?}: {}",
            irradiance(&restored)
        );
    }
    // Where nothing was cut off there is nothing to raise.
    let whole = ball(Some(10.0)).unwrap(&radiance(mirror(&flat, 10.0, 0.7)), None, 64, ONE);
    let refused = restore_sun(&whole.unwrap(), &grey, grey_circle, None, None, ONE).unwrap_err();
    assert!(matches!(refused, Error::Undetermined { .. }));
}

#[test]
fn what_is_no_ball_is_refused() {
    let picture = radiance(vec![[1.0; 3]; 280 * 280]);
    let of = |ball: MirrorBall, rows| ball.unwrap(&picture, None, rows, ONE).unwrap_err();
    let good = ball(Some(5.0));
    for (ball, rows) in [
        (ball(Some(1.0)), 32),
        (ball(Some(f64::NAN)), 32),
        (
            MirrorBall {
                reflectance: [0.0, 1.0, 1.0],
                ..good
            },
            32,
        ),
        (
            MirrorBall {
                photographer: -0.1,
                ..good
            },
            32,
        ),
        (good, 31),
        (good, 4),
    ] {
        assert!(matches!(of(ball, rows), Error::Domain { .. }));
    }
    let circle = |x: f64, radius: f64| MirrorBall {
        circle: Circle {
            x,
            y: 138.5,
            radius,
        },
        ..good
    };
    assert!(matches!(
        of(circle(20.0, 110.0), 32),
        Error::CircleOutside { .. }
    ));
    assert!(matches!(of(circle(140.0, 8.0), 32), Error::TooSmall { .. }));
    assert!(matches!(
        of(circle(f64::NAN, 110.0), 32),
        Error::CircleOutside { .. }
    ));
    let short = good.unwrap(&picture, Some(&[false; 3]), 32, ONE);
    assert!(matches!(short, Err(Error::Length { .. })));
    let all = good.unwrap(&picture, Some(&vec![true; 280 * 280]), 32, ONE);
    assert!(matches!(all, Err(Error::Unseen { .. })));
}

/// A picture that has fewer pixels than its size says, and circles that are none, end in an error or
/// change nothing.
#[test]
fn radiance_of_another_size_is_refused() {
    let circle = Circle {
        x: 32.0,
        y: 32.0,
        radius: 30.0,
    };
    let picture = |pixels: usize, clipped: usize| Radiance {
        width: 64,
        height: 64,
        pixels: vec![[1.0; 3]; pixels],
        clipped: vec![false; clipped],
        exposures: vec![1.0],
    };
    let ball = MirrorBall {
        circle,
        distance: None,
        reflectance: [0.5; 3],
        photographer: 0.0,
    };
    let unwrap = |of: &Radiance| ball.unwrap(of, None, 16, Parallelism::Sequential);
    assert!(unwrap(&picture(64 * 64, 64 * 64)).is_ok());
    for short in [picture(64 * 64 - 1, 64 * 64), picture(64 * 64, 9)] {
        assert!(matches!(unwrap(&short), Err(Error::Length { .. })));
        assert_eq!(refine(&short, circle), circle);
    }
    for radius in [0.0, -1.0, 1e12] {
        let circle = Circle { radius, ..circle };
        assert_eq!(refine(&picture(64 * 64, 64 * 64), circle), circle);
    }
}
