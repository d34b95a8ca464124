//! The command line as it is read.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};

use lobes::evaluation::Preset;
use lobes::exchange::Format;
use lobes::features::Continuation;
use lobes::illumination::builtin_names;
use lobes::picture::Circle;
use lobes::reflectance::{Fresnel, Variant};
use lobes::sphere::Mapping;
use lobes_experiments::{Method, Protocol};

/// Reflectance in the frequency domain: what a surface is, from what it does to natural light.
#[derive(Debug, Parser)]
#[command(name = "lobes", version, about, max_term_width = 100, after_help = AFTER)]
pub(super) struct Arguments {
    /// How many threads to use [default: one a core].
    #[arg(long, short, global = true, value_name = "N", value_parser = up_to_1024)]
    pub(super) jobs: Option<NonZeroUsize>,
    /// Say the answer and what is wrong, and nothing else.
    #[arg(long, short, global = true)]
    pub(super) quiet: bool,
    /// Give the answer as JSON, an object a line, instead of tables and sentences.
    #[arg(long, global = true)]
    pub(super) json: bool,
    #[command(subcommand)]
    pub(super) verb: Verb,
}

/// A count that memory and time are set aside for, so that a slip of the finger does not take the
/// machine.
fn up_to_1024(text: &str) -> Result<NonZeroUsize, String> {
    match text.parse::<NonZeroUsize>() {
        Ok(count) if count.get() <= 1024 => Ok(count),
        _ => Err("give a whole number from 1 to 1024".into()),
    }
}

/// A count of pictures, none of which is kept.
fn up_to_a_million(text: &str) -> Result<NonZeroUsize, String> {
    match text.parse::<NonZeroUsize>() {
        Ok(count) if count.get() <= 1_000_000 => Ok(count),
        _ => Err("give a whole number from 1 to 1000000".into()),
    }
}

const AFTER: &str = "\
Examples:
  lobes reproduce
  lobes classify photo.jpg
  lobes spectrum --json sky.hdr
  lobes render --light blender-city

Exit codes:
  0    done
  1    something that was given or met is wrong; one sentence on standard error says what
  2    the command line cannot be read
  130  stopped by Ctrl-C, or asked to end; nothing is left half-written

Answers go to standard output, everything else to standard error. Progress is shown on a terminal only. The environment \
variable NO_COLOR takes colour away.";

#[derive(Debug, Subcommand)]
pub(super) enum Verb {
    /// The paper's figures and accuracy table, as a page, from maps of real light.
    Reproduce(Reproduce),
    /// The finish and the reflectance of the ball in each picture, and its name if asked for.
    Classify(Classify),
    /// Power spectra of light: the k / l^(2+η) fit, whiteness, and what clipping does.
    Spectrum(Spectrum),
    /// Spheres of one or all materials under a map, as PNG and EXR.
    Render(Render),
    /// How far estimated light is from the truth: three balls under both, published protocols.
    Evaluate(Evaluate),
    /// The light about a mirror ball, from photographs of it, as a lat-long map.
    Probe(Probe),
    /// Ward's parameters of a measured surface, by least squares.
    Fit(Fit),
    /// The names of the built-in lights, the preset materials, or the lobes.
    List(List),
    /// The accuracy contracts, measured: the contents of ACCURACY.md.
    Accuracy(Accuracy),
    /// How often the finish of a photographed ball is told right, on simulated photographs.
    Finishes(Finishes),
    /// What a shell needs to complete the command's arguments.
    Completions(Completions),
    /// The manual page of the command, or of a verb.
    Man(Man),
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lobes list lights
  lobes list materials --materials paints.toml
  lobes list materials --as radiance > materials.rad
  lobes list lobes --json")]
pub(super) struct List {
    /// What is listed.
    #[arg(value_enum)]
    pub(super) what: Listed,
    /// Write the materials as another program reads them, for a file.
    #[arg(long = "as", value_name = "FORMAT", value_parser = one_of(Format::ALL, Format::name))]
    pub(super) written_as: Option<Format>,
    #[command(flatten)]
    pub(super) materials: Materials,
}

/// What `list` lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Listed {
    /// The built-in maps, for --light.
    Lights,
    /// The preset materials, or those of --materials, for --material.
    Materials,
    /// Ward's lobes, for --lobe.
    Lobes,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lobes completions bash > ~/.local/share/bash-completion/completions/lobes
  lobes completions zsh > ~/.zfunc/_lobes
  lobes completions fish > ~/.config/fish/completions/lobes.fish")]
pub(super) struct Completions {
    /// The shell.
    pub(super) shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lobes man > lobes.1
  lobes man render > lobes-render.1")]
pub(super) struct Man {
    /// The verb; without it, the page of the command.
    pub(super) verb: Option<String>,
}

/// Where light comes from.
#[derive(Debug, Args)]
pub(super) struct Lights {
    /// A folder of environment maps (.hdr, .exr, .pfm) instead of the built-in ones.
    #[arg(long, value_name = "DIR")]
    pub(super) illuminations: Option<PathBuf>,
    /// How the maps' pixels lie on the sphere, where their shape does not tell.
    #[arg(long, value_name = "NAME", value_parser = one_of(Mapping::ALL, Mapping::name))]
    pub(super) mapping: Option<Mapping>,
    /// A TOML file that says which maps are of one place and so are left out together; see
    /// docs/how-to/groups.md.
    #[arg(long, value_name = "FILE")]
    pub(super) groups: Option<PathBuf>,
}

/// The specular lobe.
#[derive(Debug, Args)]
pub(super) struct Lobe {
    /// The specular lobe, one of Ward's four (`lobes list lobes`).
    #[arg(id = "lobe", long = "lobe", value_name = "NAME", default_value_t, value_parser = one_of(Variant::ALL, Variant::name))]
    pub(super) name: Variant,
}

/// The specular lobe of a rendering.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RenderLobe {
    /// One of Ward's.
    Ward(Variant),
    /// GGX.
    Ggx,
}

impl RenderLobe {
    const ALL: [Self; 5] = [
        Self::Ward(Variant::ALL[0]),
        Self::Ward(Variant::ALL[1]),
        Self::Ward(Variant::ALL[2]),
        Self::Ward(Variant::ALL[3]),
        Self::Ggx,
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Ward(variant) => variant.name(),
            Self::Ggx => "ggx",
        }
    }

    /// Ward's variant, if it is one.
    pub(super) fn ward(self) -> Option<Variant> {
        match self {
            Self::Ward(variant) => Some(variant),
            Self::Ggx => None,
        }
    }
}

impl std::str::FromStr for RenderLobe {
    type Err = lobes::Error;

    fn from_str(name: &str) -> Result<Self, lobes::Error> {
        if name == Self::Ggx.name() {
            return Ok(Self::Ggx);
        }
        name.parse().map(Self::Ward).map_err(|error| match error {
            lobes::Error::UnknownName {
                what,
                name,
                mut names,
            } => {
                names.push(Self::Ggx.name().into());
                lobes::Error::UnknownName { what, name, names }
            }
            error => error,
        })
    }
}

/// A complex index of refraction as it is written, n+ki.
fn metal(text: &str) -> Result<Fresnel, String> {
    let parts = text.strip_suffix('i').and_then(|text| text.split_once('+'));
    let numbers = parts.and_then(|(n, k)| Some((n.parse().ok()?, k.parse().ok()?)));
    let Some((index, extinction)) = numbers else {
        return Err("a metal's index is written n+ki, as 0.17+3.14i".into());
    };
    let metal = Fresnel::Conductor { index, extinction };
    metal.check().map_err(|error| error.to_string())?;
    Ok(metal)
}

/// What spheres are made of.
#[derive(Debug, Args)]
pub(super) struct Materials {
    /// A file of materials instead of the eight presets: TOML, or glTF (.gltf), Mitsuba's (.xml) or
    /// Radiance's (.rad); see docs/how-to/materials.md.
    #[arg(long, value_name = "FILE")]
    pub(super) materials: Option<PathBuf>,
    /// Read the presets' numbers as albedos ρ_d and ρ_s, not as Radiance's arguments.
    #[arg(long, conflicts_with = "materials")]
    pub(super) as_albedos: bool,
    /// Only the material of this name; may be repeated.
    #[arg(long = "material", value_name = "NAME", value_parser = Suggested(material_names), hide_possible_values = true)]
    pub(super) only: Vec<String>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lobes reproduce
  lobes reproduce --illuminations probes --mapping angular-map --out report-of-probes
  lobes reproduce --protocol blind --classifier paper --classifier combined
  lobes reproduce --materials data/materials/other-first.toml --lobe ward1992")]
pub(super) struct Reproduce {
    #[command(flatten)]
    pub(super) lights: Lights,
    #[command(flatten)]
    pub(super) materials: Materials,
    /// The specular lobe, one of Ward's four (`lobes list lobes`); may be repeated.
    #[arg(long = "lobe", value_name = "NAME", default_value = Variant::default().name(), value_parser = one_of(Variant::ALL, Variant::name))]
    pub(super) lobes: Vec<Variant>,
    /// Which pictures every classifier is tried on; may be repeated. `files` is what classify makes
    /// of pictures in files. It takes minutes; without it there is the paper's own table only,
    /// which takes seconds.
    #[arg(long = "protocol", value_name = "NAME", value_parser = protocols())]
    pub(super) protocols: Vec<Protocols>,
    /// Which classifiers are tried under --protocol; may be repeated [default: all].
    #[arg(long = "classifier", value_name = "NAME", value_parser = one_of(Method::ALL, Method::name))]
    pub(super) classifiers: Vec<Method>,
    /// From how many directions about the vertical the spheres to learn from are seen; the paper's
    /// features learn from one.
    #[arg(long, value_name = "N", default_value = "8", value_parser = up_to_1024)]
    pub(super) turns: NonZeroUsize,
    /// The seed of the sensor's noise and of the random reflectances.
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    pub(super) seed: u64,
    /// Write the table of protocols and classifiers into a Markdown file, between its two marks,
    /// and the calibration beside it.
    #[arg(long, value_name = "FILE")]
    pub(super) write: Option<PathBuf>,
    /// What stands behind the sphere in the page's figures: mirror, half-turn or zero.
    #[arg(long, value_name = "NAME", default_value_t = Continuation::Mirror)]
    pub(super) continuation: Continuation,
    /// Pixels along an image's side.
    #[arg(long, value_name = "PIXELS", default_value_t = 128)]
    pub(super) size: usize,
    /// Where the page and its files go.
    #[arg(long, value_name = "DIR", default_value = "report")]
    pub(super) out: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lobes spectrum
  lobes spectrum sky.hdr probe.exr --degree 64 --plot sky.svg
  lobes spectrum --mapping angular-map grace_probe.hdr
  lobes spectrum --json sky.hdr > sky.json")]
pub(super) struct Spectrum {
    /// Environment maps (.hdr, .exr, .pfm), or - for standard input; without any, the built-in
    /// ones.
    pub(super) files: Vec<PathBuf>,
    /// How the maps' pixels lie on the sphere, where their shape does not tell.
    #[arg(long, value_name = "NAME", value_parser = one_of(Mapping::ALL, Mapping::name))]
    pub(super) mapping: Option<Mapping>,
    /// The largest degree, where the map carries it [default: 128].
    #[arg(long, value_name = "L")]
    pub(super) degree: Option<usize>,
    /// Plot the spectra into this file, as SVG.
    #[arg(long, value_name = "FILE", value_parser = svg)]
    pub(super) plot: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lobes render --light blender-city
  lobes render --light sky.hdr --material \"old gold\" --size 512 --out gold
  lobes render --light blender-city --elevation 45 --distance 4
  lobes render --set spheres.toml --out spheres")]
pub(super) struct Render {
    #[command(flatten)]
    pub(super) materials: Materials,
    /// The light: the name of a built-in map (`lobes list lights`), a file, or - for standard
    /// input.
    #[arg(
        long,
        value_name = "NAME|FILE",
        value_parser = Suggested(light_names),
        hide_possible_values = true,
        required_unless_present = "set",
        conflicts_with = "set"
    )]
    pub(super) light: Option<String>,
    /// Render every material under every light from every camera that a TOML file names; see
    /// docs/how-to/training-sets.md.
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with_all = [
            "materials", "as_albedos", "mapping", "only", "lobe", "ior", "metal", "bound", "size", "tolerance",
            "elevation", "azimuth", "distance"
        ]
    )]
    pub(super) set: Option<PathBuf>,
    /// How the light's pixels lie on the sphere, where the shape does not tell.
    #[arg(long, value_name = "NAME", value_parser = one_of(Mapping::ALL, Mapping::name))]
    pub(super) mapping: Option<Mapping>,
    /// The specular lobe: one of Ward's four (`lobes list lobes`), or ggx, of which each material
    /// is read with α = σ and Schlick's reflectance, F₀ = ρs.
    #[arg(long, value_name = "NAME", default_value = Variant::default().name(), value_parser = one_of(RenderLobe::ALL, RenderLobe::name))]
    pub(super) lobe: RenderLobe,
    /// With --lobe ggx: the index of refraction of what the facets are of, one or three.
    #[arg(
        long,
        value_name = "INDEX",
        value_delimiter = ',',
        conflicts_with = "metal"
    )]
    pub(super) ior: Vec<f64>,
    /// With --lobe ggx: facets of a metal without a body, its complex index written n+ki, one or
    /// three (gold: 0.17+3.14i,0.35+2.71i,1.51+1.88i).
    #[arg(long, value_name = "N+KI", value_delimiter = ',', value_parser = metal)]
    pub(super) metal: Vec<Fresnel>,
    /// Prove a bound of each pixel's error, and write those beside the picture. It takes longer;
    /// pictures of GGX have it always.
    #[arg(long)]
    pub(super) bound: bool,
    /// Pixels along the image's side.
    #[arg(long, value_name = "PIXELS", default_value_t = 128)]
    pub(super) size: usize,
    /// The relative error to stay under.
    #[arg(
        long,
        value_name = "ERROR",
        default_value_t = 1e-3,
        allow_negative_numbers = true
    )]
    pub(super) tolerance: f64,
    /// The camera's height above the horizon, in degrees.
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(super) elevation: f64,
    /// The camera's azimuth: 0 looks along −z, and it grows to the left.
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(super) azimuth: f64,
    /// A perspective camera at this many radii from the centre, instead of an orthographic one.
    #[arg(long, value_name = "RADII", allow_negative_numbers = true)]
    pub(super) distance: Option<f64>,
    /// Where the images go.
    #[arg(long, value_name = "DIR", default_value = "spheres")]
    pub(super) out: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lobes accuracy > ACCURACY.md
  lobes accuracy --json --snapshots oracles/snapshots")]
pub(super) struct Accuracy {
    /// The folder of the oracles' snapshots; by default oracles/snapshots of the repository that
    /// holds the current folder.
    #[arg(long, value_name = "DIR")]
    pub(super) snapshots: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lobes evaluate truth.exr estimate.exr
  lobes evaluate truth ours theirs --out evaluated
  lobes evaluate truth.exr estimate.exr --preset stylelight
  lobes evaluate truth ours --rows 128 --json

The keys of --json, an object for each pair:
  scene, estimate   the name that truth and estimate share, and whose estimate it is; with error, in place of all else, where they
                    cannot be compared
  balls             the errors of each ball's picture, by ball and by measure
  light             the errors of the map itself, by measure
  and at the end one for each estimate: estimate, scenes (how many), average (mean or median), balls, light, definitions

DIR holds index.html, errors.csv (scene, estimate, ball, measure, value), summary.json, and in done what is kept of each pair: a second
run compares only what has changed.")]
pub(super) struct Evaluate {
    /// The true light: a lat-long map (.exr, .hdr, .pfm), or a folder of them.
    pub(super) truth: PathBuf,
    /// Estimates of it: maps, or folders of maps with the names of the true ones.
    #[arg(required = true, value_name = "ESTIMATE")]
    pub(super) estimates: Vec<PathBuf>,
    /// What is rendered and measured; see docs/reference/evaluation.md.
    #[arg(long, value_name = "NAME", default_value_t = Preset::Recommended, value_parser = one_of(Preset::ALL, Preset::name))]
    pub(super) preset: Preset,
    /// Bring all maps to so many rows first.
    #[arg(long, value_name = "ROWS")]
    pub(super) rows: Option<usize>,
    /// How the maps' pixels lie on the sphere, where their shape does not tell.
    #[arg(long, value_name = "NAME", value_parser = one_of(Mapping::ALL, Mapping::name))]
    pub(super) mapping: Option<Mapping>,
    /// Pixels along a picture's side.
    #[arg(long, value_name = "PIXELS", default_value_t = 128)]
    pub(super) size: usize,
    /// How many scenes of each estimate the page shows, the worst first.
    #[arg(long, value_name = "N", default_value_t = 12)]
    pub(super) shown: usize,
    /// Compare all pairs anew.
    #[arg(long)]
    pub(super) fresh: bool,
    /// Where the page and its files go.
    #[arg(long, value_name = "DIR", default_value = "evaluated")]
    pub(super) out: PathBuf,
}

/// A reflectance of all channels, or of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Channels(pub(super) [f64; 3]);

impl std::str::FromStr for Channels {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.parse::<Numbers>()?.0[..] {
            [all] => Ok(Self([all; 3])),
            [r, g, b] => Ok(Self([r, g, b])),
            _ => Err("give one number, or three with commas between them".into()),
        }
    }
}

/// Numbers with commas between them.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Numbers(pub(super) Vec<f64>);

impl std::str::FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text
            .split(',')
            .map(|word| match word.trim().parse::<f64>() {
                Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
                _ => Err(format!("{word:?} is no number above 0")),
            });
        Ok(Self(numbers.collect::<Result<_, _>>()?))
    }
}

#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  lobes probe ball.jpg --distance 12 --out light.exr
  lobes probe dark.jpg middle.jpg bright.jpg --distance 12
  lobes probe front-1.jpg front-2.jpg --other side-1.jpg side-2.jpg --turn 90 --distance 12
  lobes probe ball.exr --distance 12 --grey 812,604,390 --albedo 0.18

The map is in the camera's frame: the camera stands towards +z, +y is up, and the centre column looks along -z, past the ball. Its alpha
channel says what of each pixel was seen: 0 behind the ball, where the photographer stands and under the mask; colours there are filled
from about them.

The keys of --json: file, rows, circle (x, y and radius in pixels), distance (in radii, or null), exposures (by which each photograph was
divided), exposures_told (whether EXIF or --exposures told all of them), seen (share of the sphere), clipped (share that every photograph
saturated), sun_raised (by how much, by channel, or null).")]
pub(super) struct Probe {
    /// Photographs of one view of the ball, at one exposure or several: JPEG, PNG, WebP, TIFF, or linear
    /// OpenEXR, Radiance or PFM.
    #[arg(required = true, value_name = "PHOTO")]
    pub(super) photos: Vec<PathBuf>,
    /// Photographs of another side of it.
    #[arg(long, value_name = "PHOTO", num_args = 1.., requires = "turn")]
    pub(super) other: Vec<PathBuf>,
    /// How far the camera of --other stands round the ball from that of the first, in degrees
    /// anticlockwise as seen from above.
    #[arg(
        long,
        value_name = "DEGREES",
        allow_negative_numbers = true,
        requires = "other"
    )]
    pub(super) turn: Option<f64>,
    /// Where the ball is, in pixels from the left and the top, and its radius; found without it.
    #[arg(long, value_name = "X,Y,R", allow_hyphen_values = true)]
    pub(super) circle: Option<Circle>,
    /// Where it is in the photographs of --other.
    #[arg(
        long,
        value_name = "X,Y,R",
        allow_hyphen_values = true,
        requires = "other"
    )]
    pub(super) other_circle: Option<Circle>,
    /// How far the camera is from the ball's centre, in radii; by the focal length of EXIF without
    /// it, and as from far away where there is none.
    #[arg(long, value_name = "RADII", allow_negative_numbers = true)]
    pub(super) distance: Option<f64>,
    /// What the ball reflects, of all channels or of red, green and blue.
    #[arg(long, value_name = "SHARE", default_value = "1")]
    pub(super) reflectance: Channels,
    /// The half angle about the camera in which the photographer stands, left out.
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(super) photographer: f64,
    /// A picture of the photographs' size, white where nothing is to be read.
    #[arg(long, value_name = "FILE")]
    pub(super) mask: Option<PathBuf>,
    /// The exposures of the photographs, in any unit, where EXIF does not tell them.
    #[arg(long, value_name = "T,T,…", default_value = "", hide_default_value = true, value_parser = maybe_numbers)]
    pub(super) exposures: Numbers,
    /// Where a matte grey ball is, beside the mirror ball or in --grey-photo: what was saturated
    /// is raised until that ball looks as it does.
    #[arg(long, value_name = "X,Y,R", allow_hyphen_values = true)]
    pub(super) grey: Option<Circle>,
    /// Photographs of the grey ball alone, from where the mirror ball was photographed.
    #[arg(long, value_name = "PHOTO", num_args = 1..)]
    pub(super) grey_photo: Vec<PathBuf>,
    /// The grey ball's albedo; fitted without it.
    #[arg(long, value_name = "SHARE", requires = "grey")]
    pub(super) albedo: Option<f64>,
    /// Rows of the map [default: the ball's radius in pixels].
    #[arg(long, value_name = "ROWS")]
    pub(super) rows: Option<usize>,
    /// Where the map goes.
    #[arg(long, value_name = "FILE", default_value = "probe.exr", value_parser = exr)]
    pub(super) out: PathBuf,
}

fn maybe_numbers(text: &str) -> Result<Numbers, String> {
    if text.is_empty() {
        Ok(Numbers::default())
    } else {
        text.parse()
    }
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lobes fit gold-metallic-paint.binary
  lobes fit measured.csv --lobe ward1992 --anisotropic --plot measured.svg
  lobes fit measured.csv --json")]
pub(super) struct Fit {
    /// A MERL file (.binary), or a CSV of theta_i, phi_i, theta_o, phi_o in degrees and value in
    /// 1/sr; - for standard input.
    pub(super) file: PathBuf,
    #[command(flatten)]
    pub(super) lobe: Lobe,
    /// Fit a width along each tangent.
    #[arg(long)]
    pub(super) anisotropic: bool,
    /// Plot the residuals into this file, as SVG.
    #[arg(long, value_name = "FILE", value_parser = svg)]
    pub(super) plot: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lobes finishes
  lobes finishes --judge 40 --seed 5 --json
  lobes finishes --picture photographs.png
  lobes finishes --write docs/explanation/photographs.md
  lobes finishes --learn data/models --write docs/explanation/photographs.md")]
pub(super) struct Finishes {
    /// In how many lights balls are photographed for each row of the table, four balls in each.
    #[arg(long, value_name = "N", default_value = "150", value_parser = up_to_a_million)]
    pub(super) judge: NonZeroUsize,
    /// The seed of the photographs that are judged [default: 77].
    #[arg(long, value_name = "SEED")]
    pub(super) seed: Option<u64>,
    /// Write the table into a Markdown file, between its two marks.
    #[arg(long, value_name = "FILE")]
    pub(super) write: Option<PathBuf>,
    /// Write a sheet of the photographs that are judged, as PNG, and do nothing else.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["write", "learn"])]
    pub(super) picture: Option<PathBuf>,
    /// Make the model anew, write it into this folder, and judge it.
    #[arg(long, value_name = "DIR")]
    pub(super) learn: Option<PathBuf>,
    /// In how many lights balls are photographed to learn from.
    #[arg(long, value_name = "N", default_value = "7000", requires = "learn", value_parser = up_to_a_million)]
    pub(super) lights: NonZeroUsize,
    /// How many balls in each of them.
    #[arg(long, value_name = "N", default_value = "20", requires = "learn", value_parser = up_to_1024)]
    pub(super) balls: NonZeroUsize,
    /// How often each photograph is learned from.
    #[arg(long, value_name = "N", default_value = "12", requires = "learn", value_parser = up_to_1024)]
    pub(super) epochs: NonZeroUsize,
}

/// What `--protocol` names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Protocols {
    All,
    One(Protocol),
    /// `lobes classify` itself, through files.
    Files,
}

fn protocols() -> impl TypedValueParser<Value = Protocols> {
    let names = Protocol::ALL.map(Protocol::name).into_iter();
    PossibleValuesParser::new(names.chain(["files", "all"])).try_map(|name| match name.as_str() {
        "all" => Ok(Protocols::All),
        "files" => Ok(Protocols::Files),
        name => name.parse().map(Protocols::One),
    })
}

/// One of the values of an enum, by its name: the names are listed, completed, and told where there
/// is no such name.
fn one_of<T, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T>
where
    T: std::str::FromStr<Err = lobes::Error> + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(all.map(name)).try_map(|name| name.parse::<T>())
}

/// Any word, with names that a shell completes it to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Suggested(fn() -> Vec<String>);

impl TypedValueParser for Suggested {
    type Value = String;

    fn parse_ref(
        &self,
        command: &clap::Command,
        argument: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<String, clap::Error> {
        StringValueParser::new().parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new((self.0)().into_iter().map(PossibleValue::new)))
    }
}

fn material_names() -> Vec<String> {
    let presets = lobes::reflectance::presets();
    presets
        .iter()
        .map(|material| material.name().to_owned())
        .collect()
}

fn light_names() -> Vec<String> {
    builtin_names().map(str::to_owned).collect()
}

/// The plot's place: a name that ends in .svg, or a device or a pipe, which has no say in the
/// format.
fn svg(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let ending = path
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase();
    if ending == "svg"
        || std::fs::metadata(&path).is_ok_and(|data| !data.is_file() && !data.is_dir())
    {
        Ok(path)
    } else {
        Err("plots are SVG; give a name that ends in .svg".into())
    }
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  lobes classify photo.jpg
  lobes classify photo.jpg --circle 812,604,390
  lobes classify ball.png --names
  lobes classify pictures --json > answers.jsonl
  lobes classify ball.jpg --pbr ball.gltf
  lobes classify ball.jpg --light light.exr --report
  lobes classify vase.exr --normals normals.exr --mask mask.png
  lobes classify pictures --report --out pages

The keys of --json, an object a picture:
  file              the picture; with error, in place of all else, where it could not be read
  finish            the likeliest finish, or null where \"no single finish\" is likelier
  finishes          the probability of each finish; with no_single_finish they add up to 1
  no_single_finish  the probability that no finish explains the ball: glass, or a picture of a ball
  sigma, share      Ward's roughness, of a surface that is not matte, and the specular share ρs / (ρs + ρd): the median, and the low
                    and high end of the interval that holds the truth with a probability of 90 %
  sigma_below       0.02 where all that can be said is that σ is below it, else null
  base_colour       the body's albedo, or a metal's reflectance, up to the light's colour: medians of red, green and blue, and the
                    low and high ends of their 90 % intervals
  metallic          the probability that it is a metal
  roughness         glTF's roughness factor √σ, the median
  names             under --names: the likeliest material or null, the probability of each, that of none of these, and the σ, share
                    and mode that were learned beside the names
  circle            where the sphere is: x, y and radius in pixels
  found             whether it was found in the picture, not given by --circle or by a mask
  others            circles that may be spheres too
  saturated         the share of the sphere's pixels that are saturated
  seen              the share of the circle that lies in the picture
  grey              whether it has no colour, and was named without
  distance          how far the camera is, in radii of the sphere, or null where that is not known")]
pub(super) struct Classify {
    /// Pictures, each of a sphere: linear OpenEXR, Radiance or PFM, or PNG, JPEG, WebP or TIFF; a folder stands
    /// for the pictures in it, and - for standard input.
    #[arg(required = true, value_name = "IMAGE")]
    pub(super) images: Vec<PathBuf>,
    /// Name the material too, one of the paper's eight or of --materials. The first time, spheres
    /// of them are rendered to learn from, which takes a minute. Implied by every option that says
    /// what to learn from.
    #[arg(long)]
    pub(super) names: bool,
    /// Write the likeliest materials for other programs: glTF (.gltf), Mitsuba (.xml) or Radiance
    /// (.rad).
    #[arg(long, value_name = "FILE", value_parser = exchanged)]
    pub(super) pbr: Option<PathBuf>,
    /// Write the light about the ball as a lat-long map, OpenEXR, and its standard deviation beside it
    /// (light.exr and light-deviation.exr); of one picture.
    #[arg(long = "light", value_name = "FILE", value_parser = exr)]
    pub(super) light: Option<PathBuf>,
    #[command(flatten)]
    pub(super) materials: Materials,
    #[command(flatten)]
    pub(super) lights: Lights,
    /// Where the sphere is, in pixels from the left and the top, and its radius; without it the
    /// mask (alpha) tells, or it is found.
    #[arg(long, value_name = "X,Y,R", allow_hyphen_values = true)]
    pub(super) circle: Option<Circle>,
    /// Read every ball of a picture, not the one that is seen best.
    #[arg(long, conflicts_with_all = ["circle", "light"])]
    pub(super) all: bool,
    #[command(flatten)]
    pub(super) shape: Shape,
    /// A page: each ball as it was read and how likely each answer is; with --light the light, its
    /// deviation, the ball again in that light, and what is left over.
    #[arg(long)]
    pub(super) report: bool,
    /// Where the page goes, and the overlays that show where a sphere was found.
    #[arg(long, value_name = "DIR", default_value = "classified")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(super) lobe: Lobe,
    /// By how many cameras all round, level and tilted, far and near, the spheres to learn from are
    /// seen.
    #[arg(long, value_name = "N", default_value = "16", value_parser = up_to_1024)]
    pub(super) turns: NonZeroUsize,
    /// Learn anew, without the features that an earlier run kept.
    #[arg(long)]
    pub(super) fresh: bool,
}

/// A shape that is no ball.
#[derive(Debug, Args)]
pub(super) struct Shape {
    /// The picture shows another shape than a ball, whose normals are these: OpenEXR with components
    /// of −1 … 1, or PNG with codes of (1 + n)/2; of one picture, of one size with it.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["circle", "all"])]
    pub(super) normals: Option<PathBuf>,
    /// Where the shape is, where it is white or opaque; without it, where there are normals.
    #[arg(long, value_name = "FILE", requires = "normals")]
    pub(super) mask: Option<PathBuf>,
    /// In which frame the normals are.
    #[arg(long, value_enum, default_value_t, requires = "normals")]
    pub(super) frame: Frame,
    /// With --frame world, the direction from the shape to the camera.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, default_value = "0,0,1", value_parser = direction)]
    pub(super) towards: [f64; 3],
    /// With --frame world, a direction that the picture shows upwards.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, default_value = "0,1,0", value_parser = direction)]
    pub(super) up: [f64; 3],
    /// The focal length in pixels; without it the picture's EXIF tells, or the camera is taken to be
    /// far away.
    #[arg(long, value_name = "PIXELS", requires = "normals")]
    pub(super) focal: Option<f64>,
}

/// A frame of normals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum Frame {
    /// The camera's own: x to the right, y up, z towards the camera.
    #[default]
    Camera,
    /// OpenCV's: x to the right, y down, z away from the camera.
    Opencv,
    /// The world's: --towards and --up say how the camera stands in it.
    World,
}

/// Three numbers with commas between them.
fn direction(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|part| {
            part.trim()
                .parse()
                .ok()
                .filter(|value: &f64| value.is_finite())
        })
        .collect();
    numbers
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| "give three numbers, x,y,z".into())
}

impl Classify {
    /// Whether a name is asked for, by itself or by what names are learned from.
    pub(super) fn wants_names(&self) -> bool {
        let materials = &self.materials;
        self.names
            || self.fresh
            || materials.materials.is_some()
            || materials.as_albedos
            || !materials.only.is_empty()
            || self.lights.illuminations.is_some()
    }
}

/// The name of an OpenEXR file.
fn exr(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let ending = path
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase();
    if ending == "exr" {
        Ok(path)
    } else {
        Err("the light is written as OpenEXR; give a name that ends in .exr".into())
    }
}

/// A place for materials, whose ending says in which format they are written.
fn exchanged(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match Format::of_path(&path) {
        Some(_) => Ok(path),
        None => Err("give a name that ends in .gltf, .xml (Mitsuba) or .rad (Radiance)".into()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    /// Every verb's help ends with examples, and the command line reads every one.
    #[test]
    fn examples_are_read() {
        let command = Arguments::command();
        command.clone().debug_assert();
        for verb in command.get_subcommands() {
            let help = verb.clone().render_help().to_string();
            let examples: Vec<&str> = help
                .lines()
                .filter_map(|line| line.strip_prefix("  lobes "))
                .collect();
            assert!(examples.len() >= 2, "{}: {help}", verb.get_name());
            for example in examples {
                let words = example.split(" > ").next().unwrap_or_default();
                // One quoted word at most.
                let mut parts = words.split('"');
                let mut line: Vec<&str> = vec!["lobes"];
                line.extend(parts.next().unwrap_or_default().split_whitespace());
                line.extend(parts.next());
                line.extend(parts.next().unwrap_or_default().split_whitespace());
                let read = Arguments::try_parse_from(&line);
                assert!(read.is_ok(), "{line:?}: {:?}", read.err());
            }
        }
    }
}
