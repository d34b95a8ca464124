//! `lobes classify`: the finish and the reflectance of the ball in a picture, and its name.

use std::path::{Path, PathBuf};

use serde_json::json;

use crate::arguments::Classify;
use crate::error::{Error, Result};
use crate::output::OutputFolder;
use crate::report::{Figure, Image, Inline, Page, posterior_map};
use crate::{ball_light, console, input, lights, materials, progress, training};
use lobes::Parallelism;
use lobes::exchange::{self, Format};
use lobes::illumination::Luminance;
use lobes::inference::{
    FinishModel, FinishVerdict, Model, Portrait, PortraitReader, SphereFeatures, Verdict,
};
use lobes::picture::{Circle, Picture, Sphere as Cut};
use lobes::picture::{encode_png, encode_spheres};
use lobes::reflectance::{Finish, Material};
use lobes::reflection::SphereImage;

/// A sphere as it was read.
struct Sphere {
    circle: Circle,
    found: bool,
    /// What else in the picture may be a sphere.
    others: Vec<Circle>,
    saturated: f64,
    /// The share of the circle that lies in the picture.
    seen: f64,
    distance: Option<f64>,
    portrait: Portrait,
    /// What names are told by, where they are asked for.
    features: Option<SphereFeatures>,
    grey: bool,
    /// The sphere itself, where its light is asked for.
    image: Option<SphereImage>,
    /// A PNG of it, for the page.
    picture: Option<Vec<u8>>,
    /// A PNG that shows where it was found, and its width and height.
    overlay: Option<(Vec<u8>, (usize, usize))>,
}

/// What is said of a sphere.
struct Answer {
    finish: FinishVerdict,
    name: Option<Verdict>,
}

/// What spheres are judged by.
struct Judge {
    reader: PortraitReader,
    finishes: FinishModel,
    /// Learned where names are asked for, once there is something to name.
    names: Option<Model>,
}

impl Judge {
    fn answer(&self, sphere: &Sphere) -> Result<Answer> {
        let name = self.names.as_ref().zip(sphere.features.as_ref());
        Ok(Answer {
            finish: self.finishes.verdict(&sphere.portrait)?,
            name: name
                .map(|(model, features)| model.verdict(features))
                .transpose()?,
        })
    }
}

/// So many pictures are read, judged and told at a time: what is kept of them does not grow with
/// how many there are.
const AT_A_TIME: usize = 128;

pub(super) fn run(options: &Classify) -> Result<()> {
    let paths = expand(&options.images)?;
    let materials = if options.wants_names() {
        materials::load(&options.materials)?
    } else {
        Vec::new()
    };
    let mut pages = Pages::new(options)?;
    let mut judge = Judge {
        reader: PortraitReader::new()?,
        finishes: FinishModel::builtin()?,
        names: None,
    };
    let alone = paths.len() == 1;
    if options.light.is_some() && !alone {
        return Err(Error::request(
            format!(
                "--light writes the light about one ball, and {} pictures are given",
                paths.len()
            ),
            "give one",
        ));
    }
    let (mut failed, mut problem) = (0, None);
    let mut counts = Counts::new(&materials);
    let mut exported = Vec::new();
    let bar = progress::bar(paths.len(), "pictures");
    for (turn, paths) in paths.chunks(AT_A_TIME).enumerate() {
        let spheres = Parallelism::Rayon.map(paths.len(), |i| {
            let sphere = read(&paths[i], options, &judge.reader);
            bar.inc(1);
            sphere
        });
        // Learning takes a while: not where there is nothing to name.
        let nameable = options.wants_names() && spheres.iter().any(Result::is_ok);
        if nameable && judge.names.is_none() {
            judge.names = Some(bar.suspend(|| learn(options, &materials))?);
        }
        let answers = Parallelism::Rayon.map(paths.len(), |i| match &spheres[i] {
            Ok(sphere) => judge.answer(sphere),
            Err(error) => Err(error.clone()),
        });
        for (i, (path, (sphere, answer))) in
            paths.iter().zip(spheres.iter().zip(&answers)).enumerate()
        {
            let read = match (sphere, answer) {
                (Ok(sphere), Ok(answer)) => Ok((sphere, answer)),
                (Err(error), _) | (_, Err(error)) => Err(error),
            };
            match read {
                Err(error) => {
                    failed += 1;
                    problem = Some(of_file(path, error));
                }
                Ok((sphere, answer)) => {
                    counts.add(answer);
                    if let (Some(path), Some(image)) = (&options.light, &sphere.image) {
                        let material = answer.finish.likeliest_material("ball")?;
                        ball_light::write(path, image, &material)?;
                    }
                    if options.pbr.is_some() {
                        let name = input::name(path);
                        exported.push(answer.finish.likeliest_material(&name)?);
                    }
                }
            }
            bar.suspend(|| tell(path, &read, &materials, alone))?;
            pages.add(AT_A_TIME * turn + i + 1, path, &read, &materials)?;
        }
    }
    bar.finish_and_clear();
    let summary = counts.summary(failed);
    if !alone {
        console::answer(&summary);
    }
    if let Some(path) = options.pbr.as_deref().filter(|_| !exported.is_empty()) {
        export(path, &exported)?;
    }
    pages.finish(&summary)?;
    match problem {
        None => Ok(()),
        Some(problem) if alone => Err(problem),
        Some(_) => Err(Error::Partly {
            failed,
            total: paths.len(),
            what: "pictures were not classified".into(),
        }),
    }
}

/// Writes materials for the program that the file's ending names, and says what it cannot express.
fn export(path: &Path, materials: &[Material]) -> Result<()> {
    // The ending was looked at when the command line was read.
    let format = Format::of_path(path).unwrap_or(Format::Gltf);
    let written = exchange::write(format, materials)?;
    crate::output::write_file(path, written.text.as_bytes())?;
    for note in &written.notes {
        console::note(note.to_string());
    }
    console::note(format!("wrote {}", path.display()));
    Ok(())
}

fn learn(options: &Classify, materials: &[Material]) -> Result<Model> {
    let (maps, scenes) = lights::load(&options.lights)?;
    let (lobe, turns) = (options.lobe.name, options.turns.get());
    let mut training = training::load(&maps, materials, lobe, turns, options.fresh)?;
    training.named.scenes = scenes;
    Ok(Model::learn(&training, Parallelism::Rayon)?)
}

/// What was read of a picture, or why nothing was.
type Read<'a> = std::result::Result<(&'a Sphere, &'a Answer), &'a Error>;

/// Says what a picture shows, or what is wrong with it: of one that is alone the command itself
/// says that.
fn tell(path: &Path, read: &Read, learned: &[Material], alone: bool) -> Result<()> {
    match read {
        Ok((sphere, answer)) => {
            console::json(&line_of_json(path, sphere, answer, learned))?;
            let sentence = sentence(sphere, answer, learned);
            console::answer(format!("{}: {sentence}", input::name(path)));
        }
        Err(error) => {
            let error = of_file(path, error).to_string();
            console::json(&json!({ "file": input::name(path), "error": error }))?;
            if !console::is_json() && !alone {
                console::complain(format!("lobes: {error}"));
            }
        }
    }
    Ok(())
}

/// The error with the file that it is about.
fn of_file(path: &Path, error: &Error) -> Error {
    input::error_of(path, error.clone())
}

/// The files, folders replaced by the pictures in them.
fn expand(images: &[PathBuf]) -> Result<Vec<PathBuf>> {
    const ENDINGS: [&str; 10] = [
        "png", "jpg", "jpeg", "webp", "tif", "tiff", "exr", "hdr", "pic", "pfm",
    ];
    let mut paths = Vec::new();
    for image in images {
        if !image.is_dir() {
            paths.push(image.clone());
            continue;
        }
        let unreadable = |error: std::io::Error| {
            Error::file(
                image,
                format!("the folder cannot be read ({error})"),
                "name another",
            )
        };
        let mut of_folder = Vec::new();
        for entry in std::fs::read_dir(image).map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
            if ending.is_some_and(|e| ENDINGS.contains(&e.as_str())) {
                of_folder.push(path);
            }
        }
        if of_folder.is_empty() {
            return Err(Error::file(
                image,
                "the folder holds no picture",
                format!(
                    "put some there, {}",
                    ENDINGS.map(|e| format!(".{e}")).join(" ")
                ),
            ));
        }
        of_folder.sort();
        paths.extend(of_folder);
    }
    Ok(paths)
}

fn read(path: &Path, options: &Classify, reader: &PortraitReader) -> Result<Sphere> {
    let photo = if input::is_standard(path) {
        Picture::from_bytes(&input::bytes()?)?
    } else {
        Picture::read(path)?
    };
    let (circle, others) = match options.circle {
        Some(circle) => (circle, Vec::new()),
        None => photo.circles()?,
    };
    let found = options.circle.is_none() && !photo.has_mask();
    let sphere = photo.sphere(circle)?;
    let image = &sphere.image;
    let exposure = 0.25 / Luminance::Rec709.of(image.mean());
    Ok(Sphere {
        circle,
        found,
        others,
        saturated: sphere.saturated,
        seen: sphere.seen,
        distance: image.camera().distance(),
        portrait: reader.of_sphere(&photo, circle, &sphere)?,
        features: if options.wants_names() {
            Some(SphereFeatures::of(&sphere)?)
        } else {
            None
        },
        grey: sphere.is_grey(),
        image: options.light.is_some().then(|| image.clone()),
        picture: if options.report {
            Some(encode_spheres(&[image], 1, 0, exposure)?)
        } else {
            None
        },
        overlay: if found {
            Some(overlay(&photo, circle, exposure)?)
        } else {
            None
        },
    })
}

/// The picture, no larger than 640 pixels, with the circle on it.
fn overlay(photo: &Picture, circle: Circle, exposure: f64) -> Result<(Vec<u8>, (usize, usize))> {
    let scale = photo.width().max(photo.height()).div_ceil(640);
    let line = 1.5f64.max(0.01 * circle.radius / scale as f64) * scale as f64;
    let (width, height) = (photo.width() / scale, photo.height() / scale);
    let png = encode_png(width, height, exposure, |row, column| {
        let (y, x) = (row * scale, column * scale);
        let off = (x as f64 + 0.5 - circle.x).hypot(y as f64 + 0.5 - circle.y);
        if (off - circle.radius).abs() < line {
            // Magenta at full strength whatever the exposure.
            return Some([1.0, 0.0, 1.0].map(|value| value / exposure));
        }
        photo.get(y, x)
    })?;
    Ok((png, (width, height)))
}

/// How many pictures show what: by name where names are asked for, else by finish.
struct Counts {
    names: Vec<String>,
    of_names: bool,
    /// Of each of the names, and of none.
    counts: Vec<usize>,
}

impl Counts {
    fn new(materials: &[Material]) -> Self {
        let of_names = !materials.is_empty();
        let mut names: Vec<String> = if of_names {
            materials.iter().map(|m| m.name().to_owned()).collect()
        } else {
            Finish::ALL
                .iter()
                .map(|finish| finish.name().to_owned())
                .collect()
        };
        names.push(
            if of_names {
                NONE_OF_THESE
            } else {
                NO_SINGLE_FINISH
            }
            .to_owned(),
        );
        Self {
            counts: vec![0; names.len()],
            names,
            of_names,
        }
    }

    fn add(&mut self, answer: &Answer) {
        let place = if self.of_names {
            answer.name.as_ref().and_then(Verdict::material)
        } else {
            answer.finish.finish().map(Finish::index)
        };
        self.counts[place.unwrap_or(self.names.len() - 1)] += 1;
    }

    fn summary(&self, failed: usize) -> String {
        let mut most: Vec<(usize, &String)> =
            self.counts.iter().copied().zip(&self.names).collect();
        most.retain(|(count, _)| *count > 0);
        most.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
        let mut parts: Vec<String> = most.iter().map(|(n, name)| format!("{n} {name}")).collect();
        if failed > 0 {
            parts.push(format!("{failed} not read"));
        }
        let total = self.counts.iter().sum::<usize>() + failed;
        format!("{total} pictures: {}", parts.join(", "))
    }
}

const NONE_OF_THESE: &str = "none of these";
const NO_SINGLE_FINISH: &str = "no single finish";

/// Whether the pictures of two materials differ by their exposure only: one finish, and albedos
/// that are the same multiple of the other's.
fn same_but_for_exposure(a: &Material, b: &Material) -> bool {
    let albedos = |m: &Material| -> Vec<f64> { [m.diffuse(), m.specular()].concat() };
    let (p, q) = (albedos(a), albedos(b));
    let (sum_p, sum_q) = (p.iter().sum::<f64>(), q.iter().sum::<f64>());
    let mut pairs = p.iter().zip(&q);
    pairs.all(|(x, y)| (x * sum_q - y * sum_p).abs() <= 1e-9 * sum_p * sum_q)
        && (a.is_matte() || a.roughness() == b.roughness())
}

/// The probability with which intervals hold the truth.
const LEVEL: f64 = 0.9;

/// Low end, median and high end of a 90 % interval.
fn interval(quantile: impl Fn(f64) -> f64) -> [f64; 3] {
    [0.05, 0.5, 0.95].map(quantile)
}

/// The likeliest answers with their probabilities, those of a hundredth and more, the likeliest
/// first.
fn ranked<'a>(answers: impl IntoIterator<Item = (f64, &'a str)>) -> Vec<(f64, &'a str)> {
    let mut answers: Vec<(f64, &str)> = answers.into_iter().collect();
    answers.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut place = 0;
    answers.retain(|(p, _)| {
        place += 1;
        place == 1 || *p >= 0.01
    });
    answers
}

fn listed(answers: &[(f64, &str)]) -> String {
    let all = answers.iter().map(|(p, name)| format!("{name} {p:.2}"));
    all.collect::<Vec<_>>().join(", ")
}

fn finishes(verdict: &FinishVerdict) -> Vec<(f64, &'static str)> {
    let of = verdict
        .finishes
        .into_iter()
        .zip(Finish::ALL.map(Finish::name));
    ranked(of.chain([(verdict.none, NO_SINGLE_FINISH)]))
}

fn names<'a>(verdict: &Verdict, materials: &'a [Material]) -> Vec<(f64, &'a str)> {
    let of = verdict
        .probabilities
        .iter()
        .copied()
        .zip(materials.iter().map(Material::name));
    let mut all = ranked(of);
    all.truncate(3);
    ranked(all.into_iter().chain([(verdict.none, NONE_OF_THESE)]))
}

/// σ in words.
fn roughness(verdict: &FinishVerdict) -> String {
    match verdict.sigma.below() {
        Some(end) => format!("σ below {end}"),
        None => {
            let [low, middle, high] = verdict.sigma.interval(LEVEL);
            format!("σ {middle:.3} (90 %: {low:.3} – {high:.3})")
        }
    }
}

fn sentence(sphere: &Sphere, answer: &Answer, materials: &[Material]) -> String {
    let finish = &answer.finish;
    let mut text = listed(&finishes(finish));
    match finish.finish() {
        // Of what is not understood nothing is measured.
        None => text.push_str(
            "; glass, a picture of a ball, or a pattern that hides the finish: no other number is given",
        ),
        Some(likeliest) => {
            if likeliest != Finish::Matte {
                text.push_str(&format!("; {}", roughness(finish)));
                let [low, middle, high] = finish.share.interval(LEVEL);
                text.push_str(&format!(
                    ", specular share {middle:.2} (90 %: {low:.2} – {high:.2})"
                ));
            }
            let [r, g, b] = finish.base_colour();
            text.push_str(&format!("; base colour {r:.2} {g:.2} {b:.2} in white light"));
        }
    }
    if let Some(verdict) = &answer.name {
        text.push_str(&format!("; named {}", listed(&names(verdict, materials))));
        let mut order: Vec<usize> = (0..materials.len()).collect();
        order.sort_by(|&a, &b| verdict.probabilities[b].total_cmp(&verdict.probabilities[a]));
        if let [first, second, ..] = order[..]
            && verdict.probabilities[second] >= 0.01
            && same_but_for_exposure(&materials[first], &materials[second])
        {
            text.push_str(&format!(
                "; {} and {} cannot be told apart without a reference in the picture, for they differ in brightness only",
                materials[first].name(),
                materials[second].name()
            ));
        }
        if sphere.grey {
            text.push_str("; a grey picture, named without colour");
        }
    }
    if sphere.saturated > 0.0 {
        text.push_str(&format!("; {:.1} % saturated", 100.0 * sphere.saturated));
    }
    if sphere.seen < 0.995 {
        text.push_str(&format!(
            "; {:.0} % of the sphere lies beyond the border of the picture",
            100.0 * (1.0 - sphere.seen)
        ));
    }
    if sphere.found {
        let Circle { x, y, radius } = sphere.circle;
        text.push_str(&format!("; sphere found at {x:.1},{y:.1},{radius:.1}"));
    }
    if !sphere.others.is_empty() {
        let others = sphere.others.iter();
        let circles: Vec<String> = others
            .map(|c| format!("{:.1},{:.1},{:.1}", c.x, c.y, c.radius))
            .collect();
        text.push_str(&format!(
            "; more in the picture looks like a sphere, which --circle chooses: {}",
            circles.join(" and ")
        ));
    }
    text
}

fn line_of_json(
    path: &Path,
    sphere: &Sphere,
    answer: &Answer,
    materials: &[Material],
) -> serde_json::Value {
    let numbers =
        |[low, median, high]: [f64; 3]| json!({ "low": low, "median": median, "high": high });
    let circle = |circle: &Circle| json!([circle.x, circle.y, circle.radius]);
    let finish = &answer.finish;
    let finishes: serde_json::Map<String, serde_json::Value> = Finish::ALL
        .iter()
        .zip(finish.finishes)
        .map(|(finish, p)| (finish.name().to_owned(), json!(p)))
        .collect();
    let ends = finish.base_colour_interval();
    let names = answer.name.as_ref().map(|verdict| {
        let probabilities: serde_json::Map<String, serde_json::Value> = materials
            .iter()
            .zip(&verdict.probabilities)
            .map(|(material, p)| (material.name().to_owned(), json!(p)))
            .collect();
        let (share, sigma) = verdict.posterior.mode();
        json!({
            "material": verdict.material().map(|i| materials[i].name()),
            "probabilities": probabilities,
            "none": verdict.none,
            "sigma": numbers(interval(|level| verdict.posterior.sigma_quantile(level))),
            "share": numbers(interval(|level| verdict.posterior.share_quantile(level))),
            "mode": { "share": share, "sigma": sigma },
        })
    });
    json!({
        "file": input::name(path),
        "finish": finish.finish().map(Finish::name),
        "finishes": finishes,
        "no_single_finish": finish.none,
        "sigma": numbers(finish.sigma.interval(LEVEL)),
        "sigma_below": finish.sigma.below(),
        "share": numbers(finish.share.interval(LEVEL)),
        "base_colour": {
            "low": ends.map(|[low, _]| low),
            "median": finish.base_colour(),
            "high": ends.map(|[_, high]| high),
        },
        "metallic": finish.metallic(),
        "roughness": finish.sigma.quantile(0.5).sqrt(),
        "names": names,
        "circle": circle(&sphere.circle),
        "others": sphere.others.iter().map(circle).collect::<Vec<_>>(),
        "found": sphere.found,
        "saturated": sphere.saturated,
        "seen": sphere.seen,
        "grey": sphere.grey,
        "distance": sphere.distance,
    })
}

/// The overlays, and the page where it is asked for.
struct Pages<'a> {
    options: &'a Classify,
    /// Opened when there is something to write.
    output: Option<OutputFolder>,
    page: Page,
    /// A line for each picture, with the class of its row.
    summary: Vec<(&'static str, Vec<String>)>,
}

impl<'a> Pages<'a> {
    fn new(options: &'a Classify) -> Result<Self> {
        let mut pages = Self {
            options,
            output: None,
            page: Page::new(
                "Finishes read off pictures",
                &[
                    Inline::Text(
                        "For each picture the ball that was read, the probability of each finish and, where they were asked for, of each name, and the \
                         roughness σ and the specular share ρ_s / (ρ_s + ρ_d), with the interval that holds 90 % of each. A learned model, which ",
                    ),
                    Inline::Code("docs/explanation/photographs.md"),
                    Inline::Text(" in the repository explains."),
                ],
            ),
            summary: Vec::new(),
        };
        if options.report {
            pages.output()?;
        }
        Ok(pages)
    }

    fn output(&mut self) -> Result<&mut OutputFolder> {
        match &mut self.output {
            Some(output) => Ok(output),
            none => Ok(none.insert(OutputFolder::open(&self.options.out)?)),
        }
    }

    /// What is shown of the `number`th picture.
    fn add(
        &mut self,
        number: usize,
        path: &Path,
        read: &Read,
        materials: &[Material],
    ) -> Result<()> {
        let name = if input::is_standard(path) {
            input::NAME.into()
        } else {
            path.file_name().unwrap_or_default().to_string_lossy()
        };
        let (sphere, answer) = match read {
            Ok(read) => read,
            Err(error) => {
                if self.options.report {
                    self.page.heading(&name);
                    self.page.paragraph(&error.to_string());
                    let cells = [&name, "not classified", "–", "–", "–"];
                    self.summary
                        .push(("quoted", cells.map(str::to_owned).to_vec()));
                }
                return Ok(());
            }
        };
        let stem = format!("{number:04}-{}", super::slug(&name));
        let Circle { x, y, radius } = sphere.circle;
        let mut pictures = Vec::new();
        if let Some((overlay, size)) = &sphere.overlay {
            let path = format!("{stem}-found.png");
            self.output()?.add(path.clone(), overlay)?;
            pictures.push(Figure {
                images: vec![Image {
                    path,
                    seen: format!(
                        "The picture {name} with a magenta circle about {x:.0}, {y:.0} of radius {radius:.0} pixels"
                    ),
                    size: *size,
                }],
                caption: vec!["Where the sphere was found".into()],
            });
        }
        let finish = &answer.finish;
        let said = finish.finish().map_or(NO_SINGLE_FINISH, Finish::name);
        if let Some(picture) = &sphere.picture {
            let path = format!("{stem}.png");
            self.output()?.add(path.clone(), picture)?;
            pictures.push(Figure {
                images: vec![Image {
                    path,
                    seen: format!("The sphere of {name} by itself, called {said}"),
                    size: (Cut::SIZE, Cut::SIZE),
                }],
                caption: vec!["The sphere as it was read".into()],
            });
        }
        if !self.options.report {
            return Ok(());
        }
        self.page.heading(&name);
        self.page.paragraph(&sentence(sphere, answer, materials));
        self.page.grid(220, &pictures);
        let ranked = finishes(finish);
        let mut rows: Vec<(f64, &str)> = ranked.clone();
        if let Some(verdict) = &answer.name {
            let path = format!("{stem}-posterior.svg");
            let map = posterior_map(&verdict.posterior);
            self.output()?.add(path.clone(), &map)?;
            let (share, sigma) = verdict.posterior.mode();
            self.page.drawing(
                &map,
                &format!(
                    "A map of the posterior, darkest at a specular share of {share:.2} and σ {sigma:.3}"
                ),
                &[
                    Inline::Text("The posterior of what plain spheres taught, beside the names: the darker the likelier, with a cross at its mode. "),
                    Inline::Link("As a file", &path),
                ],
            );
            rows.extend(names(verdict, materials));
        }
        let cells = |[low, middle, high]: [f64; 3], decimals: usize| {
            format!("{middle:.decimals$} ({low:.decimals$} – {high:.decimals$})")
        };
        let (p, likeliest) = ranked[0];
        let sigma = match finish.sigma.below() {
            Some(end) => format!("below {end}"),
            None => cells(finish.sigma.interval(LEVEL), 3),
        };
        self.summary.push((
            "",
            vec![
                name.to_string(),
                likeliest.to_owned(),
                format!("{p:.3}"),
                sigma,
                cells(finish.share.interval(LEVEL), 2),
            ],
        ));
        let rows: Vec<(&str, Vec<String>)> = rows
            .into_iter()
            .map(|(p, name)| ("", vec![name.to_owned(), format!("{p:.3}")]))
            .collect();
        self.page.table(
            "How likely each finish is, and each name that was asked for",
            &["answer", "probability#"],
            &rows,
        );
        Ok(())
    }

    fn finish(mut self, summary: &str) -> Result<()> {
        let Some(mut output) = self.output.take() else {
            return Ok(());
        };
        let out = &self.options.out;
        if self.options.report {
            if self.summary.len() > 1 {
                let headings = [
                    "picture",
                    "likeliest",
                    "probability#",
                    "σ, 90 % interval#",
                    "specular share, 90 % interval#",
                ];
                self.page.lead(&[Inline::Text(summary)]);
                self.page.summary("All pictures", &headings, &self.summary);
            }
            let version = format!("lobes {}", env!("CARGO_PKG_VERSION"));
            output.add("index.html", self.page.html(&[Inline::Text(&version)]))?;
        }
        output.commit()?;
        if self.options.report {
            console::note(format!("wrote {}", out.join("index.html").display()));
        } else {
            console::note(format!(
                "wrote where spheres were found to {}",
                out.display()
            ));
        }
        Ok(())
    }
}
