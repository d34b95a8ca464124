//! Shapes with known normals, read as balls: made by formulas, shaded by normals alone.

use lobes::glam::{DQuat, DVec3};
use lobes::illumination::builtin;
use lobes::inference::{EvidenceReader, ReflectanceGrid, natural_spectrum};
use lobes::picture::{Circle, NormalFrame, Normals, Picture, ShapeBall};
use lobes::reflectance::{Material, Variant};
use lobes::reflection::{Camera, Renderer, Settings, SphereImage, Viewpoint};
use lobes::{Error, Parallelism};

const SIDE: usize = 240;

/// The normal in the camera's frame at a place of −1.2 … 1.2, y up.
type Shape = fn(f64, f64) -> Option<DVec3>;

fn ellipsoid(x: f64, y: f64) -> Option<DVec3> {
    let (a, b, c) = (1.1, 0.75, 0.9);
    let square = 1.0 - (x / a).powi(2) - (y / b).powi(2);
    let z = c * square.max(0.0).sqrt();
    (square > 0.0).then(|| DVec3::new(x / (a * a), y / (b * b), z / (c * c)).normalize())
}

/// |x|^p + |y|^p + |z|^p = 1.
fn superquadric(x: f64, y: f64) -> Option<DVec3> {
    let p = 2.6;
    let rest = 1.0 - x.abs().powf(p) - y.abs().powf(p);
    let slope = |v: f64| v.abs().powf(p - 1.0) * v.signum();
    (rest > 0.0).then(|| DVec3::new(slope(x), slope(y), slope(rest.powf(1.0 / p))).normalize())
}

/// A torus that is seen from 40° above its plane, by steps of its distance along the ray.
fn torus(x: f64, y: f64) -> Option<DVec3> {
    let tilt = DQuat::from_rotation_x(40f64.to_radians());
    let (large, small) = (0.75, 0.32);
    let towards = tilt.inverse() * DVec3::Z;
    let mut place = tilt.inverse() * DVec3::new(x, y, 2.0);
    for _ in 0..400 {
        let around = place.x.hypot(place.z);
        let distance = (around - large).hypot(place.y) - small;
        if distance < 1e-6 {
            let ring = DVec3::new(place.x, 0.0, place.z) * (large / around);
            return Some(tilt * (place - ring).normalize());
        }
        place -= towards * distance;
        if place.length() > 4.0 {
            return None;
        }
    }
    None
}

/// Hills on a plane that faces the camera.
fn hills(x: f64, y: f64) -> Option<DVec3> {
    let slope = |at: f64| 0.9 * (4.0 * at).cos();
    Some(DVec3::new(-slope(x), -slope(y), 1.0).normalize())
}

/// The places of the pixels.
fn places() -> impl Iterator<Item = (f64, f64)> {
    let at = |i: usize| 2.4 * (i as f64 + 0.5) / SIDE as f64 - 1.2;
    (0..SIDE * SIDE).map(move |i| (at(i % SIDE), -at(i / SIDE)))
}

fn components(shape: Shape) -> Vec<[f64; 3]> {
    let all = places().map(|(x, y)| shape(x, y).map_or([0.0; 3], |n| n.to_array()));
    all.collect()
}

fn normals(shape: Shape) -> Normals {
    Normals::new(SIDE, SIDE, &components(shape), NormalFrame::Camera, None).unwrap()
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

fn shaded(shape: Shape, of: impl Fn(DVec3) -> [f64; 3]) -> Picture {
    let pixels = places().map(|(x, y)| shape(x, y).map_or([0.0; 3], &of));
    Picture::linear(SIDE, SIDE, pixels.collect()).unwrap()
}

/// What varies slowly with the normal comes back at its normal.
#[test]
fn a_shape_is_the_ball_of_its_normals() {
    let of = |n: DVec3| [0.5 + 0.3 * n.x, 0.5 + 0.3 * n.y, 0.2 + 0.5 * n.z];
    for (name, shape) in [
        ("ellipsoid", ellipsoid as Shape),
        ("superquadric", superquadric),
        ("torus", torus),
    ] {
        let ball = normals(shape).ball(&shaded(shape, of)).unwrap();
        println!("{name}: reach {}, coverage {}", ball.reach, ball.coverage);
        assert!(
            ball.reach >= ShapeBall::WHOLE && ball.coverage > 0.9,
            "{name}"
        );
        assert!(ball.left_out < 1e-3, "{name}: {}", ball.left_out);
        let sphere = ball.picture.sphere(ball.circle).unwrap().image;
        let mut worst = 0.0f64;
        for (row, column, rgb) in sphere.iter() {
            let at = |index: usize| (2 * index + 1) as f64 / 96.0 - 1.0;
            let (x, y) = (at(column), -at(row));
            if x.hypot(y) < 0.9 {
                let expected = of(DVec3::new(x, y, (1.0 - x * x - y * y).sqrt()));
                for c in 0..3 {
                    worst = worst.max((rgb[c] - expected[c]).abs());
                }
            }
        }
        println!("{name}: off by {worst:.4}");
        assert!(worst < 0.02, "{name}: {worst}");
    }
    // Hills end at a slope, and so do their normals.
    let ball = normals(hills).ball(&shaded(hills, of)).unwrap();
    let steepest = 0.9 / 1f64.hypot(0.9);
    assert!(
        (0.55..steepest + 0.06).contains(&ball.reach),
        "{}",
        ball.reach
    );
    assert!(ball.reach < ShapeBall::WHOLE && ball.coverage < 0.6);
}

/// σ of shapes beside σ of a ball under the same light, by evidence with nothing learned.
#[test]
fn the_roughness_of_shapes_is_read() {
    let maps = builtin().unwrap();
    let lobe = Variant::RadianceSampled;
    let rayon = Parallelism::Rayon;
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
    let reader = EvidenceReader::new(Viewpoint::Orthographic).unwrap();
    let shares: Vec<f64> = (1..8).map(|i| f64::from(i) / 8.0).collect();
    let sigmas: Vec<f64> = (0..14).map(|i| 0.02 * 1.22f64.powi(i)).collect();
    let spectra = [natural_spectrum(0.4, 127)];
    let grid = |reader: &EvidenceReader, noise: f64| {
        let layout = reader.layout();
        ReflectanceGrid::new(lobe, layout, &shares, &sigmas, &spectra, noise, rayon).unwrap()
    };
    let whole = grid(&reader, ShapeBall::NOISE);
    let part = EvidenceReader::within(Viewpoint::Orthographic, 0.6).unwrap();
    let of_part = grid(&part, ShapeBall::NOISE_OF_PART);
    let settings = Settings {
        size: 256,
        ..Settings::default()
    };
    let (mut shapes, mut balls, mut parts) = (Vec::new(), Vec::new(), Vec::new());
    for map in [&maps[1], &maps[7], &maps[13]] {
        let renderer = Renderer::new(map, rayon).unwrap();
        for sigma in [0.05, 0.1, 0.2] {
            let material = Material::from_albedos("satin", [0.3; 3], [0.3; 3], sigma).unwrap();
            let ball = renderer.render(&material, lobe, &camera, &settings, rayon);
            let ball = ball.unwrap().image;
            let off = |reader: &EvidenceReader, grid: &ReflectanceGrid, image: &SphereImage| {
                let reading = reader.read(image).unwrap();
                let posterior = grid.posterior(&reading.luminance, &reading.lights, 0.01);
                (posterior.unwrap().sigma_quantile(0.5) / sigma - 1.0).abs()
            };
            let pixels = (0..256 * 256).map(|i| ball.get(i / 256, i % 256).unwrap_or_default());
            let photographed = Picture::linear(256, 256, pixels.collect()).unwrap();
            let circle = Circle {
                x: 128.0,
                y: 128.0,
                radius: 128.0,
            };
            let cut = photographed.sphere(circle).unwrap().image;
            balls.push(off(&reader, &whole, &cut));
            for shape in [ellipsoid as Shape, superquadric, torus, hills] {
                let picture = shaded(shape, |normal| at(&ball, normal));
                let made = normals(shape).ball(&picture).unwrap();
                let image = made.picture.sphere(made.circle).unwrap().image;
                if made.reach >= ShapeBall::WHOLE {
                    shapes.push(off(&reader, &whole, &image));
                } else {
                    parts.push(off(&part, &of_part, &image));
                }
            }
        }
    }
    let median = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let [shape, ball, part] = [&mut shapes, &mut balls, &mut parts].map(median);
    println!(
        "σ off by {:.1} % of shapes, {:.1} % of balls, {:.1} % of hills (medians)",
        100.0 * shape,
        100.0 * ball,
        100.0 * part
    );
    assert!(shape < 0.12 && ball < 0.12 && part < 0.4);
}

/// A cast shadow on a part of the pixels of every normal.
#[test]
fn shadows_are_left_out() {
    let of = |n: DVec3| [0.5 + 0.3 * n.x, 0.5 + 0.3 * n.y, 0.2 + 0.5 * n.z];
    let plain = shaded(ellipsoid, of);
    let shadow = |i: usize| (i % SIDE).is_multiple_of(5);
    let pixels = plain.radiance().enumerate();
    let pixels = pixels.map(|(i, rgb)| rgb.map(|v| if shadow(i) { 0.3 * v } else { v }));
    let dark = Picture::linear(SIDE, SIDE, pixels.collect()).unwrap();
    let [plain, dark] = [plain, dark].map(|picture| normals(ellipsoid).ball(&picture).unwrap());
    assert!((0.08..0.21).contains(&dark.left_out), "{}", dark.left_out);
    // Left in it would take 14 % of the light; where few pixels have one normal it is.
    let mean = |ball: &ShapeBall| ball.picture.sphere(ball.circle).unwrap().image.mean()[2];
    assert!(
        mean(&dark) > 0.85 * mean(&plain),
        "{}",
        mean(&dark) / mean(&plain)
    );
}

/// A near camera: the mirrored directions are kept, so that a mirror is unwrapped exactly.
#[test]
fn a_near_camera_is_taken_into_account() {
    // A ball of radius 1 at distance 4 of a pinhole: what is mirrored is a smooth light.
    let (distance, focal) = (4.0, 400.0);
    let light = |d: DVec3| 1.0 + 0.5 * d.x + 0.3 * d.y;
    let (mut all, mut shown) = (Vec::new(), Vec::new());
    for i in 0..SIDE * SIDE {
        let x = (i % SIDE) as f64 + 0.5 - 0.5 * SIDE as f64;
        let y = 0.5 * SIDE as f64 - (i / SIDE) as f64 - 0.5;
        let ray = DVec3::new(x, y, -focal).normalize();
        let from = DVec3::new(0.0, 0.0, distance);
        let half = from.dot(ray);
        let square = half * half - (distance * distance - 1.0);
        if square <= 0.0 {
            all.push([0.0; 3]);
            shown.push([0.0; 3]);
            continue;
        }
        let normal = from + ray * (-half - square.sqrt());
        all.push(normal.to_array());
        shown.push([light(ray - 2.0 * normal.dot(ray) * normal); 3]);
    }
    let normals = Normals::new(SIDE, SIDE, &all, NormalFrame::Camera, None).unwrap();
    let picture = Picture::linear(SIDE, SIDE, shown).unwrap();
    let ball = normals
        .ball(&picture.with_focal_length(focal).unwrap())
        .unwrap();
    let image = ball.picture.sphere(ball.circle).unwrap().image;
    for (row, column, rgb) in image.iter() {
        let at = |index: usize| (2 * index + 1) as f64 / 96.0 - 1.0;
        let (x, y) = (at(column), -at(row));
        if x.hypot(y) < 0.85 {
            let n = DVec3::new(x, y, (1.0 - x * x - y * y).sqrt());
            let expected = light(2.0 * n.z * n - DVec3::Z);
            assert!(
                (rgb[0] - expected).abs() < 0.02,
                "{x} {y}: {} {expected}",
                rgb[0]
            );
        }
    }
}

#[test]
fn what_is_no_map_of_normals_is_refused() {
    let good = components(ellipsoid);
    let make = |all: &[[f64; 3]], frame| Normals::new(SIDE, SIDE, all, frame, None);
    let picture = shaded(ellipsoid, |n| [0.5 + 0.3 * n.x; 3]);
    let each = |f: &dyn Fn([f64; 3]) -> [f64; 3]| -> Vec<[f64; 3]> {
        good.iter()
            .map(|n| if *n == [0.0; 3] { *n } else { f(*n) })
            .collect()
    };
    // Codes that were not decoded, and half of the length.
    for wrong in [
        each(&|n| n.map(|v| 0.5 * (v + 1.0))),
        each(&|n| n.map(|v| 0.5 * v)),
    ] {
        let error = make(&wrong, NormalFrame::Camera).unwrap_err();
        assert!(error.to_string().contains("length of a normal"), "{error}");
    }
    assert!(matches!(
        make(&vec![[0.0; 3]; SIDE * SIDE], NormalFrame::Camera),
        Err(Error::Empty { .. })
    ));
    let nothing = vec![0.0f32; SIDE * SIDE];
    let masked = Normals::new(SIDE, SIDE, &good, NormalFrame::Camera, Some(&nothing));
    assert!(matches!(masked, Err(Error::Empty { .. })));
    assert!(matches!(
        Normals::new(SIDE, SIDE - 1, &good, NormalFrame::Camera, None),
        Err(Error::Length { .. })
    ));
    let few = Normals::new(SIDE, SIDE, &good, NormalFrame::Camera, Some(&nothing[1..]));
    assert!(matches!(few, Err(Error::Length { .. })));
    let infinite = each(&|[x, y, _]| [x, y, f64::INFINITY]);
    assert!(matches!(
        make(&infinite, NormalFrame::Camera),
        Err(Error::NotFinite { .. })
    ));
    // Frames that are not the one that was said: y down, z away, axes swapped, turned.
    let turned = DQuat::from_rotation_y(0.9);
    for wrong in [
        each(&|[x, y, z]| [x, -y, z]),
        each(&|[x, y, z]| [-x, y, z]),
        each(&|[x, y, z]| [x, -y, -z]),
        each(&|[x, y, z]| [y, x, z]),
        each(&|[x, y, z]| [x, z, y]),
        each(&|[x, y, z]| [z, x, y]),
        each(&|n| (turned * DVec3::from(n)).to_array()),
    ] {
        let error = make(&wrong, NormalFrame::Camera).unwrap().ball(&picture);
        assert!(matches!(error, Err(Error::NormalFrame { .. })), "{error:?}");
    }
    // And with the right one said.
    let camera = make(&good, NormalFrame::Camera).unwrap();
    let down = each(&|[x, y, z]| [x, -y, -z]);
    let close = |a: &Normals| {
        let places = (0..SIDE * SIDE).map(|i| (i / SIDE, i % SIDE));
        let mut pairs = places.filter_map(|(r, c)| Some((a.get(r, c)?, camera.get(r, c)?)));
        pairs.all(|(a, b)| (a - b).length() < 1e-12)
    };
    assert!(close(&make(&down, NormalFrame::OpenCv).unwrap()));
    let world = each(&|n| (turned * DVec3::from(n)).to_array());
    let frame = NormalFrame::world(turned * DVec3::Z, DVec3::Y).unwrap();
    assert!(close(&make(&world, frame).unwrap()));
    for (towards, up) in [
        (DVec3::ZERO, DVec3::Y),
        (DVec3::Y, DVec3::Y),
        (DVec3::Z, DVec3::new(f64::NAN, 0.0, 0.0)),
    ] {
        assert!(NormalFrame::world(towards, up).is_err());
    }
    // A picture of another size, and too little of a shape.
    let other = Picture::linear(2, 2, vec![[1.0; 3]; 4]).unwrap();
    assert!(matches!(camera.ball(&other), Err(Error::Length { .. })));
    let mut corner = vec![0.0f32; SIDE * SIDE];
    corner[SIDE * SIDE / 2 + SIDE / 2] = 1.0;
    let tiny = Normals::new(SIDE, SIDE, &good, NormalFrame::Camera, Some(&corner)).unwrap();
    assert!(matches!(tiny.ball(&picture), Err(Error::TooFew { .. })));
}

/// Codes hold (1 + n)/2, whatever curve pictures of codes have.
#[test]
fn normals_are_read_from_codes() {
    let codes: Vec<u8> = components(ellipsoid)
        .iter()
        .flat_map(|n| {
            if *n == [0.0; 3] {
                [0; 3]
            } else {
                n.map(|v| (127.5 * (v + 1.0)).round() as u8)
            }
        })
        .collect();
    let picture = Picture::from_srgb8(SIDE, SIDE, codes).unwrap();
    let read = Normals::of_picture(&picture, NormalFrame::Camera, None).unwrap();
    let exact = normals(ellipsoid);
    for i in 0..SIDE * SIDE {
        let (a, b) = (read.get(i / SIDE, i % SIDE), exact.get(i / SIDE, i % SIDE));
        assert_eq!(a.is_some(), b.is_some());
        if let (Some(a), Some(b)) = (a, b) {
            assert!((a - b).length() < 0.012, "{a} {b}");
        }
    }
    assert_eq!((read.width(), read.height()), (SIDE, SIDE));
    assert_eq!(read.get(SIDE, 0), None);
}
