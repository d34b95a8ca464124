//! What can go wrong with a caller's data, in one type.

use std::path::PathBuf;

/// The result of anything in this crate that can fail.
///
/// ```
/// use lobes::{Result, check_finite};
/// fn total(power: &[f64]) -> Result<f64> {
///     check_finite("the power of light", power)?;
///     Ok(power.iter().sum())
/// }
/// assert_eq!(total(&[2.0, 1.0])?, 3.0);
/// assert!(total(&[2.0, f64::NAN]).is_err());
/// # Ok::<(), lobes::Error>(())
/// ```
pub type Result<T> = std::result::Result<T, Error>;

/// What can go wrong with a caller's data.
///
/// Each message is one sentence: what is wrong, where, and what is allowed.
///
/// ```
/// use lobes::{Error, harmonics::Coefficients};
/// let error = Coefficients::from_vec(1, 1, vec![0.0; 3]).unwrap_err();
/// assert!(matches!(error, Error::Length { expected: 4, got: 3, .. }));
/// assert_eq!(error.to_string(), "the coefficients has 3 values where 4 are needed");
/// ```
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An array is not as long as the operation needs.
    #[error("{what} has {got} values where {expected} are needed")]
    Length {
        /// The array.
        what: &'static str,
        /// How many values it must have.
        expected: usize,
        /// How many it has.
        got: usize,
    },
    /// A harmonic degree is beyond what the grid, the table or the algorithm carries.
    #[error("degree {degree} is beyond {limit}, the largest that {what} carries")]
    Degree {
        /// Whose limit it is.
        what: &'static str,
        /// The degree that was asked for.
        degree: usize,
        /// The largest allowed.
        limit: usize,
    },
    /// A parameter lies outside its domain.
    #[error("{what} is {value}, which is not {allowed}")]
    Domain {
        /// The parameter.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The domain, in words that complete "which is not …".
        allowed: &'static str,
    },
    /// A value that must be finite is not.
    #[error("{what} holds {value} at index {index}; every value must be finite")]
    NotFinite {
        /// The array.
        what: &'static str,
        /// The index of the first such value.
        index: usize,
        /// The value.
        value: f64,
    },
    /// A tolerance was asked for that could not be met.
    #[error("{what} reached an error of {reached:e} where {asked:e} was asked for")]
    Tolerance {
        /// The computation.
        what: &'static str,
        /// The tolerance asked for.
        asked: f64,
        /// The error reached, as estimated.
        reached: f64,
    },
    /// A lobe that a caller gave has a value that no lobe has.
    #[error(
        "the lobe {lobe:?} is {value} in a direction of the light, where it has to be finite and not negative"
    )]
    Lobe {
        /// What the caller calls it.
        lobe: String,
        /// Its value; one that is not finite may be that of a sum.
        value: f64,
    },
    /// Nothing has the name that was given.
    #[error("there is no {what} {name:?}; the names are {}", names.join(", "))]
    UnknownName {
        /// What was named.
        what: &'static str,
        /// The name.
        name: String,
        /// The names that there are.
        names: Vec<String>,
    },
    /// Two maps of one set hold the same pixels, so that leaving one out leaves its light in.
    #[error("the maps {first:?} and {second:?} hold the same pixels; take one of them away")]
    SameLight {
        /// The name of the first map.
        first: String,
        /// The name of the second.
        second: String,
    },
    /// A coefficient is not among those that are stored.
    #[error(
        "the coefficient of degree {degree} and order {order} is not stored; there are degrees up to {degrees} and orders up to {orders}, none beyond the degree"
    )]
    NotStored {
        /// The degree l.
        degree: usize,
        /// The order m.
        order: isize,
        /// The largest degree that is stored.
        degrees: usize,
        /// The largest order |m| that is stored.
        orders: usize,
    },
    /// Finite input led to numbers that a double does not hold.
    #[error(
        "{what} would pass the largest number, 1.8·10³⁰⁸, though what they come from is finite; scale that down first"
    )]
    Overflow {
        /// The output.
        what: &'static str,
    },
    /// What was asked for takes more memory than there is.
    #[error("{what} would have {values} values, for which there is no memory; ask for less")]
    Memory {
        /// The array.
        what: &'static str,
        /// How many values it would have; the largest `usize` stands for any number beyond.
        values: usize,
    },
    /// A linear problem would multiply the errors of its data by more than its answer bears.
    #[error(
        "{what} multiplies relative errors by {condition:.3e}, and only up to {limit} is answered; {remedy}"
    )]
    IllConditioned {
        /// The problem.
        what: &'static str,
        /// Its condition number in the maximum norm; infinite where it is singular.
        condition: f64,
        /// The largest that is answered.
        limit: f64,
        /// What bears it, in words.
        remedy: String,
    },
    /// Data do not determine a parameter of the model that is fitted to them.
    #[error("{parameter} is not determined by the measurements: {reason}")]
    Undetermined {
        /// The parameter.
        parameter: &'static str,
        /// What the data lack, in words that complete the sentence, and what to do.
        reason: &'static str,
    },
    /// There are fewer of something than an operation needs.
    #[error("the number of {items} is {got}, where {what} needs at least {needed}")]
    TooFew {
        /// The operation, or what is to be made.
        what: &'static str,
        /// What there are too few of.
        items: &'static str,
        /// How many are needed.
        needed: usize,
        /// How many there are.
        got: usize,
    },
    /// Nothing was given for something to be made of.
    #[error("{what} needs {needs}, and not all of that was given")]
    Empty {
        /// What is to be made.
        what: &'static str,
        /// What it needs, in words.
        needs: &'static str,
    },
    /// An axis on which something is tabulated does not rise.
    #[error("{what} needs two values or more, each above the one before")]
    NotRising {
        /// The axis.
        what: &'static str,
    },
    /// Something is not defined for one of the things that it could be asked of.
    #[error("{of} has no {what}: {reason}")]
    Undefined {
        /// What it was asked of.
        of: &'static str,
        /// What was asked for.
        what: &'static str,
        /// Why it is not defined, or what to ask instead.
        reason: &'static str,
    },
    /// A text does not say what it should.
    #[error("{text:?} is no {what}: give {needs}")]
    Syntax {
        /// What the text should say.
        what: &'static str,
        /// The text.
        text: String,
        /// How it is said.
        needs: &'static str,
    },
    /// A matrix cannot be factored as the covariance or the Gram matrix that it stands for.
    #[error(
        "{what} is not positive definite: what it comes from is too little, too alike or not finite"
    )]
    NotPositiveDefinite {
        /// The matrix.
        what: String,
    },
    /// One of several quaternions that should be of unit length is not.
    #[error("{what} at index {index} has the length {length}; give those of length 1")]
    NotUnit {
        /// What is not of unit length.
        what: &'static str,
        /// Its index.
        index: usize,
        /// Its length.
        length: f64,
    },
    /// An iteration came to no end.
    #[error("{what} did not settle in {steps} steps; start from less noisy data")]
    NotConverged {
        /// The iteration.
        what: &'static str,
        /// After how many steps it was given up.
        steps: usize,
    },
    /// A spectrum has no power where its logarithm, or a ratio to it, is taken.
    #[error("{what} has the power {value} at degree {degree}, {consequence}")]
    NoPower {
        /// What has the spectrum.
        what: &'static str,
        /// The degree.
        degree: usize,
        /// The power there.
        value: f64,
        /// What has no value for that, in words that end the sentence.
        consequence: &'static str,
    },
    /// A zonal kernel that is 0 at a degree cannot be taken away without regularisation.
    #[error(
        "the zonal factor of degree {degree} is 0, which only a noise floor above 0 can invert"
    )]
    NotInvertible {
        /// The degree.
        degree: usize,
    },
    /// A colour cannot be a white that colours are adapted to.
    #[error(
        "{what} is {white:?}, which is no white: give three finite radiances that every cone sees"
    )]
    NoWhite {
        /// Whose white it should be.
        what: &'static str,
        /// The colour, linear Rec. 709.
        white: [f64; 3],
    },
    /// A picture's size fits two mappings of the sphere.
    #[error(
        "a square of {width} by {height} pixels can be an angular map or a mirror ball; say which with --mapping angular-map or \
         --mapping mirror-ball"
    )]
    AmbiguousMapping {
        /// The picture's width in pixels.
        width: usize,
        /// Its height.
        height: usize,
    },
    /// A picture's size fits no mapping of the sphere.
    #[error(
        "{width} by {height} pixels fit no mapping of the sphere; give a lat-long map (2:1), an angular map or mirror ball (1:1), \
         or a cross (3:4 or 4:3)"
    )]
    NoMapping {
        /// The picture's width in pixels.
        width: usize,
        /// Its height.
        height: usize,
    },
    /// No sphere was found in a picture.
    #[error("{reason}; give the sphere with --circle x,y,r")]
    NoSphere {
        /// What is there instead, a sentence.
        reason: &'static str,
    },
    /// Too much of the circle that was given lies beyond the border of its picture.
    #[error(
        "the circle {x:.1},{y:.1},{radius:.1} leaves the picture of {width} by {height} pixels; give one of which 85 % lies inside it"
    )]
    CircleOutside {
        /// The centre's column in pixels.
        x: f64,
        /// The centre's row.
        y: f64,
        /// The radius in pixels.
        radius: f64,
        /// The picture's width in pixels.
        width: usize,
        /// Its height.
        height: usize,
    },
    /// A picture, or the sphere in it, has too few pixels.
    #[error("{what} is {pixels:.1} pixels, too small {purpose}; {least} are needed")]
    TooSmall {
        /// The length that is too small.
        what: &'static str,
        /// How many pixels it is.
        pixels: f64,
        /// How many it must be.
        least: f64,
        /// What it is too small for, in words that begin with "to".
        purpose: &'static str,
    },
    /// A picture shows nothing where it is read.
    #[error("the image shows nothing at {what}; give a larger one, or one of the whole sphere")]
    Unseen {
        /// Where.
        what: &'static str,
    },
    /// There is no light in a picture.
    #[error("{what} is black; expose it more")]
    Black {
        /// The picture.
        what: &'static str,
    },
    /// Most of a sphere is as bright as its picture can say, so that its radiance is unknown.
    #[error("{:.0} % of the sphere is saturated; expose it less", 100.0 * share)]
    Saturated {
        /// The share of the sphere's pixels that are saturated, from 0 to 1.
        share: f64,
    },
    /// Two images that should show the two sides of a sphere do not.
    #[error(
        "the two images of a whole sphere must be from opposite cameras that are equally upright; theirs differ by {apart:.1e}"
    )]
    NotOpposite {
        /// By how much their axes, or their upward directions, miss that.
        apart: f64,
    },
    /// Normals that are not in the frame that was said.
    #[error(
        "{:.0} % of the normals {problem}, so that they are of another frame; say which: the camera's own (x right, y up, z towards it), OpenCV's (y down, z away) or the world's",
        100.0 * share
    )]
    NormalFrame {
        /// What they do.
        problem: &'static str,
        /// The share of them, from 0 to 1.
        share: f64,
    },
    /// What was made for one camera is asked of another.
    #[error("{what} was made for another camera; make it for the one that looks")]
    OtherCamera {
        /// What was made.
        what: &'static str,
    },
    /// Two maps that are compared pixel by pixel have not the same size.
    #[error(
        "the truth {truth:?} has {} by {} pixels and the estimate {estimate:?} {} by {}; bring both to one size, with --rows",
        truth_size.0, truth_size.1, estimate_size.0, estimate_size.1
    )]
    DifferentSizes {
        /// The name of the truth.
        truth: String,
        /// Its width and height in pixels.
        truth_size: (usize, usize),
        /// The name of the estimate.
        estimate: String,
        /// Its width and height.
        estimate_size: (usize, usize),
    },
    /// Pictures or maps that belong together have two sizes.
    #[error(
        "{name} has {} by {} pixels and {first} {} by {}; give pictures of one size",
        size.0, size.1, first_size.0, first_size.1
    )]
    OtherSize {
        /// The name of the one that differs.
        name: String,
        /// Its width and height in pixels.
        size: (usize, usize),
        /// The name of the first.
        first: String,
        /// Its width and height.
        first_size: (usize, usize),
    },
    /// Photographs that should be of one view show the same things at different places.
    #[error(
        "{second} shows the ball {pixels:.1} pixels off from where {first} shows it; take the bracket from a tripod, or give one picture of it"
    )]
    Moved {
        /// The name of one photograph.
        first: String,
        /// The name of the other.
        second: String,
        /// How far they are apart.
        pixels: f64,
    },
    /// Nothing says how much longer one photograph was exposed than another.
    #[error(
        "nothing says how {second} was exposed beside {first}: neither has an exposure in its EXIF, and too few pixels are well exposed in both;          give --exposures, or a photograph between the two"
    )]
    NoRatio {
        /// The name of the darker photograph.
        first: String,
        /// The name of the brighter.
        second: String,
    },
    /// A file format does not hold a picture.
    #[error(
        "{width} by {height} pixels make no {format} file: {problem}; write fewer, or another format"
    )]
    Encoding {
        /// The format's name.
        format: &'static str,
        /// The picture's width in pixels.
        width: usize,
        /// Its height.
        height: usize,
        /// What the encoder says.
        problem: String,
    },
    /// A map has more rows than the renderer takes.
    #[error(
        "the map {map:?} has {rows} rows, and the renderer takes up to {limit}; halve it first"
    )]
    TooManyRows {
        /// The map's name.
        map: String,
        /// How many rows it has.
        rows: usize,
        /// The most that are taken.
        limit: usize,
    },
    /// Two materials would have one name in a format that tells materials apart by their names.
    #[error(
        "two materials would be written to {format} as {name:?}; give one of them another name"
    )]
    SameName {
        /// The format's name.
        format: &'static str,
        /// The name that both would have.
        name: String,
    },
    /// Bytes in memory that should be what a file holds are not: see [`File`](Self::File) for those
    /// that are in one.
    #[error("{problem}; {remedy}")]
    Contents {
        /// What is wrong with them.
        problem: String,
        /// What the reader of the message can do.
        remedy: String,
    },
    /// A file cannot be read, understood or written.
    #[error("{}: {problem}; {remedy}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
        /// What the reader of the message can do.
        remedy: String,
    },
}

impl Error {
    /// An [`Error::File`].
    pub fn file(
        path: impl Into<PathBuf>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::File {
            path: path.into(),
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }
}

/// Checks that an array has the length that the operation needs.
///
/// `what` is the array, as the sentence of the error names it.
///
/// # Errors
/// [`Error::Length`] where it has another.
pub fn check_length(what: &'static str, expected: usize, got: usize) -> Result<()> {
    if got == expected {
        Ok(())
    } else {
        Err(Error::Length {
            what,
            expected,
            got,
        })
    }
}

/// Checks that there are as many of something as the operation needs.
pub(crate) fn check_count(
    what: &'static str,
    items: &'static str,
    needed: usize,
    got: usize,
) -> Result<()> {
    if got >= needed {
        Ok(())
    } else {
        Err(Error::TooFew {
            what,
            items,
            needed,
            got,
        })
    }
}

/// So many values, all the default, or an error where there is no memory for them: for arrays whose
/// length a caller chooses.
pub(crate) fn allocate<T: Clone + Default>(what: &'static str, values: usize) -> Result<Vec<T>> {
    // Asked for first, because `vec!`, which is quick for zeros, ends the process where it is
    // refused.
    Vec::<T>::new()
        .try_reserve_exact(values)
        .map_err(|_| Error::Memory { what, values })?;
    Ok(vec![T::default(); values])
}

/// Whether all values are finite, at the speed of vectors.
pub(crate) fn all_finite(values: &[f64]) -> bool {
    values
        .iter()
        .fold(true, |all, value| all & value.is_finite())
}

/// What is wrong with an output that is not finite: its input, or that finite input overflows.
pub(crate) fn not_finite(output: &'static str, what: &'static str, input: &[f64]) -> Error {
    check_finite(what, input)
        .err()
        .unwrap_or(Error::Overflow { what: output })
}

/// Checks that every value is finite.
///
/// # Errors
/// [`Error::NotFinite`] with the first that is not.
pub fn check_finite(what: &'static str, values: &[f64]) -> Result<()> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(Error::NotFinite {
            what,
            index,
            value: values[index],
        }),
    }
}
