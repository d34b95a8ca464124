//! What the fuzzers call, and what `cli/tests/fuzz_corpus.rs` calls with the corpora: readers with
//! any bytes, and numeric entry points with any lengths and values.
//!
//! A target passes if nothing panics and what is promised of an answer holds: a picture is of the
//! size that it says, moderate numbers give finite ones, an analysis gives back what was
//! synthesised.
#![allow(dead_code, reason = "each fuzzer calls one of them")]

use std::f64::consts::PI;
use std::sync::{Mutex, PoisonError};

use lobes::Parallelism::Sequential;
use lobes::features::{
    Continuation, DrorFeatures, ImageSpectrum, Needlets, PaperFeatures, UnbiasedBands,
};
use lobes::features::{LogBands, Modes, RingLayout, Unwrapped};
use lobes::files::{self, Precision};
use lobes::glam::{DQuat, DVec3};
use lobes::harmonics::{
    Basis, Coefficients, Convention, Coupling, Mask, Normalisation, Order, Phase, Rotation,
    Transform,
};
use lobes::harmonics::{average_power, convolve_zonal, cross_power, deconvolve_zonal, legendre};
use lobes::illumination::{EnvironmentMap, LightSpectrum, PowerLaw};
use lobes::inference::LogReader;
use lobes::reflectance::fit::{self, Measurement, Widths};
use lobes::reflectance::{IsotropicCoefficients, Material, Variant, Ward, approximation, recover};
use lobes::reflection::{Camera, Renderer, Settings, SphereImage, Viewpoint};
use lobes::sphere::{Grid, Mapping, Rule};

/// Bytes as they are wanted; zeros once there are no more.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn byte(&mut self) -> u8 {
        match self.0.split_first() {
            Some((&first, rest)) => {
                self.0 = rest;
                first
            }
            None => 0,
        }
    }

    fn up_to(&mut self, most: usize) -> usize {
        usize::from(self.byte()) % (most + 1)
    }

    fn flag(&mut self) -> bool {
        self.byte() & 1 == 1
    }

    fn one_of<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.up_to(of.len() - 1)]
    }

    /// Now and then any count at all.
    fn count(&mut self, most: usize) -> usize {
        match self.byte() {
            255 => usize::MAX,
            254 => usize::MAX / 2 + 1,
            253 => 1 << 32,
            252 => 1 << 20,
            byte => usize::from(byte) % (most + 1),
        }
    }

    /// Any number.
    fn number(&mut self) -> f64 {
        match self.byte() {
            0 => 0.0,
            1 => -0.0,
            2 => f64::NAN,
            3 => f64::INFINITY,
            4 => f64::NEG_INFINITY,
            5 => f64::MAX,
            6 => f64::MIN_POSITIVE,
            7 => -f64::from_bits(1),
            8 => 1.0,
            9 => -1.0,
            10 => 0.5 * PI,
            11 => f64::from_bits(u64::from_le_bytes(std::array::from_fn(|_| self.byte()))),
            _ => self.moderate(),
        }
    }

    /// A number from −8 to 8.
    fn moderate(&mut self) -> f64 {
        f64::from(i16::from_le_bytes([self.byte(), self.byte()])) / 4096.0
    }

    /// A number from 0 to 1.
    fn share(&mut self) -> f64 {
        f64::from(u16::from_le_bytes([self.byte(), self.byte()])) / 65535.0
    }

    fn numbers(&mut self, count: usize, wild: bool) -> Vec<f64> {
        (0..count)
            .map(|_| if wild { self.number() } else { self.moderate() })
            .collect()
    }

    /// A count that is right, or a little off.
    fn near(&mut self, right: usize) -> usize {
        match self.byte() {
            0 => right + 1,
            1 => right.saturating_sub(1),
            2 => 0,
            _ => right,
        }
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }

    /// Mostly of unit length.
    fn direction(&mut self) -> DVec3 {
        if self.up_to(15) == 0 {
            return self.vector();
        }
        let v = DVec3::new(self.moderate(), self.moderate(), self.moderate());
        v.try_normalize().unwrap_or(DVec3::Z)
    }

    fn variant(&mut self) -> Variant {
        self.one_of(&Variant::ALL)
    }
}

fn all_finite(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite())
}

fn picture(bytes: &[u8]) {
    if let Ok(picture) = files::decode(bytes) {
        assert_eq!(picture.pixels.len(), picture.width * picture.height);
        if picture.pixels.len() > 1 << 14 {
            return;
        }
        // What was read can be written, and reads the same.
        let single = |value: f64| f64::from(value as f32);
        if let Ok(again) = files::encode_exr(&picture, Precision::Single) {
            let again = files::decode(&again).expect("what was written");
            for (got, want) in again
                .pixels
                .as_flattened()
                .iter()
                .zip(picture.pixels.as_flattened())
            {
                assert!(*got == single(*want) || want.is_nan());
            }
        }
        for mapping in Mapping::ALL {
            let map = EnvironmentMap::from_picture(
                "bytes",
                mapping,
                picture.width,
                picture.height,
                picture.pixels.clone(),
            );
            if let Ok(map) = map {
                assert!(all_finite(map.pixels().as_flattened()));
            }
        }
    }
}

fn with_magic(magic: &[u8], bytes: &[u8]) {
    if bytes.starts_with(magic) {
        picture(bytes);
    } else {
        picture(&[magic, bytes].concat());
    }
}

/// OpenEXR.
pub(crate) fn exr(bytes: &[u8]) {
    with_magic(&[0x76, 0x2f, 0x31, 0x01], bytes);
}

/// Radiance.
pub(crate) fn hdr(bytes: &[u8]) {
    with_magic(b"#?", bytes);
}

/// Portable float maps.
pub(crate) fn pfm(bytes: &[u8]) {
    with_magic(b"P", bytes);
}

/// PNG, JPEG and any other picture, and the sphere in it.
pub(crate) fn photograph(bytes: &[u8]) {
    if let Ok(saturated) = lobes_cli::readers::photograph(bytes) {
        assert!((0.0..=1.0).contains(&saturated));
    }
}

/// Tables of measurements, files of MERL, and fits to what they hold.
pub(crate) fn measurements(bytes: &[u8]) {
    let mut rest = Bytes(bytes);
    match rest.byte() {
        0 => {
            // Cells that were not measured but for a few, so that it is quick.
            static FILE: Mutex<Vec<u8>> = Mutex::new(Vec::new());
            let cells = 90 * 90 * 180;
            let mut file = FILE.lock().unwrap_or_else(PoisonError::into_inner);
            if file.is_empty() {
                for size in [90i32, 90, 180] {
                    file.extend(size.to_le_bytes());
                }
                file.extend((0..3 * cells).flat_map(|_| (-1f64).to_le_bytes()));
            }
            let mut places = Vec::new();
            for _ in 0..16 {
                let cell =
                    (usize::from(rest.byte()) << 14 | usize::from(rest.byte()) << 6) % (3 * cells);
                places.push(12 + 8 * cell);
                file[12 + 8 * cell..20 + 8 * cell].copy_from_slice(&rest.number().to_le_bytes());
            }
            let header = file[..12].to_vec();
            if rest.up_to(7) == 0 {
                file[rest.up_to(11)] = rest.byte();
            }
            let _ = fit::parse_merl(&file, rest.count(3));
            file[..12].copy_from_slice(&header);
            for at in places {
                file[at..at + 8].copy_from_slice(&(-1f64).to_le_bytes());
            }
        }
        1 => {
            let _ = fit::parse_merl(rest.0, 0);
        }
        _ => {
            let (variant, widths) = (rest.variant(), rest.one_of(&[Widths::One, Widths::Two]));
            let Ok(text) = std::str::from_utf8(rest.0) else {
                return;
            };
            let Ok(read) = fit::parse_csv(text) else {
                return;
            };
            check_fit(&read[..read.len().min(40)], variant, widths);
        }
    }
}

fn check_fit(measurements: &[Measurement], variant: Variant, widths: Widths) {
    if let Ok(found) = fit::fit(measurements, variant, widths) {
        assert!(all_finite(&[
            found.diffuse.value,
            found.specular.value,
            found.sigma[0].value,
            found.residual
        ]));
        let _ = fit::residuals(measurements, &found);
    }
}

/// Files of materials and of training sets.
pub(crate) fn toml(bytes: &[u8]) {
    let Some((kind, rest)) = bytes.split_first() else {
        return;
    };
    let Ok(text) = std::str::from_utf8(rest) else {
        return;
    };
    if kind & 1 == 0 {
        if let Ok(count) = lobes_cli::readers::materials(text) {
            assert!(count > 0);
        }
    } else {
        let _ = lobes_cli::readers::set(text);
    }
}

/// Rules, grids, transforms and masks.
pub(crate) fn transforms(bytes: &[u8]) {
    let mut rest = Bytes(bytes);
    let _ = Rule::gauss_legendre(rest.up_to(70));
    let _ = Rule::fejer(rest.up_to(70));
    let _ = Rule::clenshaw_curtis(rest.up_to(70));
    let make = rest.one_of(&[
        Grid::gauss_legendre,
        Grid::clenshaw_curtis,
        Grid::fejer,
        Grid::lat_long,
    ]);
    let (rings, columns) = (rest.up_to(24), rest.up_to(40));
    let Ok(mut grid) = make(rings, columns) else {
        return;
    };
    if rest.flag() {
        grid = grid.with_first_azimuth(rest.moderate());
    }
    if rest.flag() {
        grid = grid.descending();
    }
    let degree = rest.count(30);
    let orders = rest.count(30);
    let plan = if rest.flag() {
        Transform::new(&grid, degree)
    } else {
        Transform::with_orders(&grid, degree, orders)
    };
    let Ok(plan) = plan else {
        return;
    };
    let wild = rest.up_to(3) == 0;
    let batch = rest.up_to(3);
    let sets_len = rest.near(batch * plan.coefficient_count());
    let maps_len = rest.near(batch * grid.len());
    let scratch_len = rest.near(plan.scratch_len(batch));
    let sets = rest.numbers(sets_len, wild);
    let (mut maps, mut back, mut scratch) = (
        vec![0.0; maps_len],
        vec![0.0; sets_len],
        vec![0.0; scratch_len],
    );
    let made = plan.synthesise_into(batch, &sets, &mut maps, &mut scratch, Sequential);
    let read = plan.analyse_into(batch, &maps, &mut back, &mut scratch, Sequential);
    // Wild numbers may be refused, or sum to what is.
    assert!(wild || made.is_ok() == read.is_ok());
    if made.is_ok() && !wild {
        assert!(all_finite(&maps) && all_finite(&back));
        if plan.degree() <= grid.max_degree() && plan.orders() <= grid.max_order() {
            for (got, want) in back.iter().zip(&sets) {
                assert!((got - want).abs() < 1e-9, "{got} for {want}");
            }
        }
    }
    let map = rest.numbers(maps_len, wild);
    if let Ok(coefficients) = plan.analyse(&map) {
        assert_eq!(
            plan.synthesise(&coefficients).map(|map| map.len()),
            Ok(grid.len())
        );
    }
    let mask = if rest.flag() {
        Mask::Cap {
            radius: rest.number(),
        }
    } else {
        Mask::Apodised {
            inner: rest.number(),
            outer: rest.number(),
        }
    };
    let mut map = map;
    let _ = mask.apply(&grid, &mut map);
    if let Ok(coupling) = Coupling::new(mask, rest.up_to(12)) {
        let len = rest.near(coupling.degree() + 1);
        let power = rest.numbers(len, wild);
        let _ = coupling.couple(&power);
        let edges: Vec<usize> = (0..rest.up_to(4)).map(|_| rest.count(14)).collect();
        let _ = coupling.decouple(&power, &edges, |l| 1.0 / (l as f64 + 1.0));
    }
}

/// Values at directions, rotation, spectra and conventions.
pub(crate) fn points(bytes: &[u8]) {
    let mut rest = Bytes(bytes);
    let wild = rest.up_to(3) == 0;
    let degree = rest.up_to(20);
    let orders = rest.count(22);
    let _ = Basis::new(rest.count(20));
    let _ = Rotation::new(rest.count(20));
    let basis = Basis::new(degree).expect("a small degree");
    let directions: Vec<DVec3> = (0..rest.up_to(11)).map(|_| rest.direction()).collect();
    let len = rest.near(directions.len() * basis.count());
    let (mut values, mut gradients) = (vec![0.0; len], vec![0.0; 3 * len]);
    if basis.values(&directions, &mut values, Sequential).is_ok() {
        assert!(all_finite(&values));
    }
    if basis
        .values_and_gradients(&directions, &mut values, &mut gradients, Sequential)
        .is_ok()
    {
        assert!(all_finite(&values) && all_finite(&gradients));
    }
    let zeros = Coefficients::zeros_with_orders(degree, orders);
    let count = rest.near(zeros.as_slice().len());
    let numbers = rest.numbers(count, wild);
    let Ok(f) = Coefficients::from_vec(degree, orders, numbers) else {
        return;
    };
    let whole = f.orders() == degree;
    let (mut sums, mut slopes) = (
        vec![0.0; directions.len()],
        vec![(0.0, DVec3::ZERO); directions.len()],
    );
    if basis.sums(&f, &directions, &mut sums, Sequential).is_ok() && !wild {
        assert!(all_finite(&sums));
        basis
            .gradients(&f, &directions, &mut slopes, Sequential)
            .expect("as the sums");
        for ((value, slope), sum) in slopes.iter().zip(&sums) {
            assert!((value - sum).abs() < 1e-9 && slope.is_finite());
        }
    }
    let turn = if rest.flag() {
        DQuat::from_xyzw(rest.number(), rest.number(), rest.number(), rest.number())
    } else {
        DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), rest.moderate())
    };
    if let Ok(turned) = f.rotated(turn)
        && !wild
    {
        let (before, after) = (f.energy(), turned.energy());
        assert!(
            (before - after).abs() <= 1e-9 * before,
            "{before} became {after}"
        );
    }
    let _ = (
        f.get(rest.count(30), rest.count(30) as isize),
        f.index(rest.count(30), -(rest.up_to(30) as isize)),
    );
    let _ = f.with_degree(rest.up_to(30));
    let power = average_power(&f);
    let _ = cross_power(&f, &zeros);
    let _ = PowerLaw::fit(&power, rest.count(8), rest.count(22));
    let len = rest.near(degree + 1);
    let factors = rest.numbers(len, wild);
    let mut g = f.clone();
    let _ = convolve_zonal(&mut g, &factors);
    let _ = deconvolve_zonal(&mut g, &factors, rest.number());
    if let Ok(kernel) = recover::recover_kernel(&f, &g) {
        let _ = recover::recover_lobe(&kernel, rest.variant());
    }
    let convention = Convention {
        normalisation: rest.one_of(&[
            Normalisation::Orthonormal,
            Normalisation::FourPi,
            Normalisation::Schmidt,
        ]),
        phase: rest.one_of(&[Phase::Plain, Phase::CondonShortley]),
    };
    let order = rest.one_of(&[Order::ByDegree, Order::ByOrder]);
    if whole && !wild {
        let real = f.to_real(convention, order);
        let back = Coefficients::from_real(degree, convention, order, &real).expect("as many");
        let complex = f.to_complex(convention);
        let twice = Coefficients::from_complex(degree, convention, &complex).expect("as many");
        for ((a, b), c) in f
            .as_slice()
            .iter()
            .zip(back.as_slice())
            .zip(twice.as_slice())
        {
            assert!((a - b).abs() < 1e-12 && (a - c).abs() < 1e-12);
        }
    }
    let (m, top) = (rest.count(20), rest.count(20));
    let len = rest.up_to(21);
    let mut column = vec![0.0; len];
    let _ = legendre::column(m, top, rest.number(), rest.number(), &mut column);
    legendre::polynomials(rest.number(), &mut column);
}

/// Lobes, materials, their coefficients and fits.
pub(crate) fn lobes(bytes: &[u8]) {
    let mut rest = Bytes(bytes);
    let variant = rest.variant();
    let sigma = |rest: &mut Bytes| {
        if rest.flag() {
            0.003 + 0.997 * rest.share()
        } else {
            rest.number()
        }
    };
    let (first, second) = (sigma(&mut rest), sigma(&mut rest));
    let _ = Material::plastic(
        "a",
        [rest.number(), rest.share(), rest.share()],
        rest.share(),
        second,
    );
    let _ = Material::metal(
        "b",
        [rest.share(), rest.share(), rest.share()],
        rest.number(),
        first,
    );
    let _ = Material::from_albedos("c", [rest.number(); 3], [rest.number(); 3], first);
    let _ = approximation::gaussian(variant, first, rest.up_to(40));
    let _ = approximation::series(variant, first, rest.up_to(40));
    let _ = approximation::oblique(variant, first, rest.number(), rest.up_to(40));
    let lobe = if rest.flag() {
        Ward::isotropic(variant, first)
    } else {
        Ward::anisotropic(variant, first, second)
    };
    let Ok(lobe) = lobe else {
        return;
    };
    for _ in 0..rest.up_to(8) {
        let (view, u) = (
            rest.direction(),
            [rest.share().min(1.0 - 1e-16), rest.share()],
        );
        let lights: Vec<DVec3> = (0..rest.up_to(10)).map(|_| rest.direction()).collect();
        let mut batch = vec![0.0; rest.near(lights.len())];
        let agreed = lobe.evaluate_batch(view, &lights, &mut batch).is_ok();
        for (i, &light) in lights.iter().enumerate() {
            let (value, density) = (lobe.evaluate(view, light), lobe.pdf(view, light));
            assert!(value >= 0.0 && density >= 0.0, "{value} {density}");
            if agreed {
                assert!(
                    (batch[i] - value).abs() <= 1e-9 * value.abs() + 1e-300,
                    "{} {value}",
                    batch[i]
                );
            }
        }
        let sample = lobe.sample(view, u);
        assert!(sample.weight >= 0.0);
        if sample.weight > 0.0 {
            assert!((sample.light.length() - 1.0).abs() < 1e-5 && sample.light.z > 0.0);
        }
        let _ = lobe.sample(view, [rest.number(), rest.number()]);
    }
    let cosine = if rest.flag() {
        0.05 + 0.95 * rest.share()
    } else {
        rest.number()
    };
    // Near grazing a quadrature has 10⁵ nodes.
    if first.min(second) > 0.02 && !(cosine > 0.0 && cosine < 0.02) {
        let (albedo, share) = (lobe.albedo(cosine), lobe.share_above_horizon(cosine));
        assert!(
            albedo >= 0.0 && (0.0..=1.0 + 1e-12).contains(&share),
            "{albedo} {share}"
        );
        if let Ok(zonal) = lobe.zonal(cosine, rest.up_to(20)) {
            assert!(all_finite(&zonal));
            assert!(
                (zonal[0] - albedo).abs() < 1e-9 * albedo.max(1.0),
                "{} {albedo}",
                zonal[0]
            );
        }
    }
    if rest.up_to(31) == 0 && first > 0.05 {
        let _ = IsotropicCoefficients::new(&lobe, rest.up_to(4), rest.up_to(4));
    }
    let measurements: Vec<Measurement> = (0..rest.up_to(12))
        .map(|_| Measurement {
            light: rest.direction(),
            view: rest.direction(),
            value: rest.number(),
            weight: rest.number(),
        })
        .collect();
    check_fit(
        &measurements,
        variant,
        rest.one_of(&[Widths::One, Widths::Two]),
    );
}

/// Maps, cameras, rendered spheres and what is read off pictures of them.
pub(crate) fn spheres(bytes: &[u8]) {
    let mut rest = Bytes(bytes);
    let wild = rest.up_to(3) == 0;
    let height = 2 * rest.up_to(5);
    let (width, count) = (rest.near(2 * height), rest.near(2 * height * height));
    let pixel = |rest: &mut Bytes| match wild {
        true => [rest.number(), rest.number(), rest.number()],
        false => [rest.share(), rest.share(), rest.share()].map(|v| v * v),
    };
    let pixels: Vec<[f64; 3]> = (0..count).map(|_| pixel(&mut rest)).collect();
    let camera = if rest.flag() {
        Camera::perspective(rest.direction(), rest.direction(), rest.number())
    } else {
        Camera::orthographic(rest.direction(), rest.direction())
    };
    let _ = Camera::filling(rest.direction(), rest.direction(), rest.number());
    let map = EnvironmentMap::new("bytes", width, height, pixels);
    if let (Ok(map), Ok(camera)) = (&map, camera) {
        let direction = rest.direction();
        let seen = map.radiance(direction);
        assert!(
            wild || seen.iter().all(|v| (0.0..=1.0 + 1e-9).contains(v)) || !direction.is_finite()
        );
        let _ = LightSpectrum::of(map, rest.up_to(12), Sequential);
        // Light is made ready by a part of a second of work: mostly for a map that stays.
        let bright = map.pixels().as_flattened().iter().any(|v| *v >= 1e100);
        if rest.byte() < 255 {
            render(lamp(), &camera, &mut rest);
        } else if let (Ok(renderer), false) = (Renderer::new(map, Sequential), bright) {
            render(&renderer, &camera, &mut rest);
        }
    }
    let which = rest.up_to(4);
    let size = rest.up_to(24);
    let count = rest.near(size * size);
    let pixels: Vec<[f64; 3]> = (0..count).map(|_| pixel(&mut rest)).collect();
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y).expect("a plain camera");
    if let Ok(image) = SphereImage::new(camera, size, pixels) {
        read_image(&image, which, wild);
    }
}

/// A map with a lamp in it.
fn lamp() -> &'static Renderer {
    static LAMP: std::sync::OnceLock<Renderer> = std::sync::OnceLock::new();
    LAMP.get_or_init(|| {
        let mut pixels = vec![[0.2, 0.3, 0.5]; 32 * 16];
        pixels[100] = [300.0, 200.0, 100.0];
        let map = EnvironmentMap::new("lamp", 32, 16, pixels).expect("a map");
        Renderer::new(&map, Sequential).expect("a renderer")
    })
}

fn render(renderer: &Renderer, camera: &Camera, rest: &mut Bytes) {
    let (variant, sigma) = (rest.variant(), 0.05 + 0.9 * rest.share());
    let material = match rest.up_to(2) {
        0 => Material::from_albedos("m", [0.5 * rest.share(); 3], [0.5; 3], sigma),
        1 => Material::from_albedos("m", [0.0; 3], [1.0; 3], 0.0),
        _ => Material::from_albedos("m", [1.0, 0.5, 0.2], [0.0; 3], 0.0),
    };
    let settings = Settings {
        size: if rest.up_to(31) == 0 {
            rest.count(6)
        } else {
            rest.up_to(6)
        },
        tolerance: if rest.flag() { 0.1 } else { rest.number() },
        pixel_samples: 1 + rest.up_to(1),
    };
    let rolled = camera.rolled(rest.number());
    // What is finer takes long.
    let fine = settings.tolerance < 5e-2 && settings.tolerance > 0.0;
    let (Ok(material), false) = (material, fine) else {
        return;
    };
    if let Ok(made) = renderer.render(&material, variant, &rolled, &settings, Sequential) {
        for (_, _, rgb) in made.image.iter() {
            assert!(rgb.iter().all(|v| *v >= 0.0 && v.is_finite()), "{rgb:?}");
        }
    }
}

/// What the plans below do not depend on bytes for is made once.
struct Readers {
    spectrum: ImageSpectrum,
    needlets: Needlets,
    unbiased: UnbiasedBands,
    layout: RingLayout,
    bands: LogBands,
    log: LogReader,
}

/// Reads the features of one kind.
fn read_image(image: &SphereImage, which: usize, wild: bool) {
    static READERS: std::sync::OnceLock<Readers> = std::sync::OnceLock::new();
    let readers = READERS.get_or_init(|| {
        let layout = RingLayout::new(Viewpoint::Orthographic, 33, 32).expect("a layout");
        Readers {
            spectrum: ImageSpectrum::new(44, Continuation::Mirror).expect("a plan"),
            needlets: Needlets::new().expect("a plan"),
            unbiased: UnbiasedBands::new().expect("a plan"),
            bands: LogBands::new(&layout).expect("a plan"),
            log: LogReader::new(Viewpoint::Orthographic).expect("a plan"),
            layout,
        }
    });
    let of_number = |features: &[f64]| assert!(wild || all_finite(features), "{features:?}");
    match which {
        0 => {
            if let Ok(features) = PaperFeatures::of_image(&readers.spectrum, image) {
                of_number(&features.to_array());
            }
        }
        1 => {
            if let Ok(features) = readers.needlets.of(image) {
                of_number(&features);
            }
        }
        2 => {
            if let Ok(features) = readers.unbiased.of(image) {
                of_number(&features);
            }
        }
        3 => {
            if let Ok(features) = readers.log.features(image) {
                of_number(&features);
            }
        }
        _ => {
            if let Ok(unwrapped) = Unwrapped::new(image, &readers.layout) {
                let _ = DrorFeatures::of(&unwrapped);
                if let Ok(features) = readers.bands.of(&unwrapped) {
                    of_number(&features);
                }
                let _ = Modes::of(&unwrapped, &readers.layout, |[r, g, b]| [r + g + b]);
            }
        }
    }
}
