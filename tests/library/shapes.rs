//! Shapes with known normals, read as balls: made by formulas, shaded by normals alone.

use lobes::Error;
use lobes::glam::{DQuat, DVec3};
use lobes::picture::{NormalFrame, Normals, Picture, ShapeBall};

// The experiments judge by the same shapes.
#[path = "../../experiments/src/known_shapes.rs"]
mod known_shapes;
use known_shapes::{SIDE, Shape, components, ellipsoid, hills, superquadric, torus};

fn normals(shape: Shape) -> Normals {
    known_shapes::normals(shape).unwrap()
}

fn shaded(shape: Shape, of: impl Fn(DVec3) -> [f64; 3]) -> Picture {
    known_shapes::shaded(shape, of).unwrap()
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
