//! A shape whose normals are known, seen as the ball that shows the same.

use glam::DVec3;

use super::circle::Circle;
use super::picture::{Picture, Pixels};
use crate::error::check_length;
use crate::illumination::Luminance;
use crate::{Error, Result};

/// In which frame normals are given.
///
/// ```
/// use lobes::glam::DVec3;
/// use lobes::picture::NormalFrame;
/// // A camera in front of the scene that looks along −z, y up: its own frame is the world's.
/// let same = NormalFrame::world(DVec3::Z, DVec3::Y)?;
/// assert_eq!(same.to_camera(DVec3::new(0.1, 0.2, 0.9)), DVec3::new(0.1, 0.2, 0.9));
/// assert_eq!(NormalFrame::OpenCv.to_camera(DVec3::new(0.1, 0.2, -0.9)), DVec3::new(0.1, -0.2, 0.9));
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NormalFrame {
    /// +x to the right of the picture, +y up, +z towards the camera (OpenGL, Blender, photometric
    /// stereo).
    Camera,
    /// +x to the right of the picture, +y down, +z away from the camera (`OpenCV`).
    OpenCv,
    /// The world's: where +x, +y and +z of the camera's own frame point.
    World {
        /// To the right of the picture.
        right: DVec3,
        /// Up.
        up: DVec3,
        /// Towards the camera.
        towards: DVec3,
    },
}

impl NormalFrame {
    /// The world's, seen by a camera that stands towards `towards`; `up` is any direction that it
    /// shows upwards.
    ///
    /// # Errors
    /// [`Error::Domain`] for vectors that are 0, not finite or along each other.
    pub fn world(towards: DVec3, up: DVec3) -> Result<Self> {
        let towards = towards.normalize_or_zero();
        let right = up.cross(towards).normalize_or_zero();
        if !(right.is_finite() && right.length_squared() > 0.5 && towards.length_squared() > 0.5) {
            return Err(Error::Domain {
                what: "the length of the camera's sideways direction",
                value: right.length(),
                allowed: "above 0: give a direction towards the camera and another one up",
            });
        }
        Ok(Self::World {
            right,
            up: towards.cross(right),
            towards,
        })
    }

    /// A normal in the camera's own frame.
    pub fn to_camera(self, normal: DVec3) -> DVec3 {
        match self {
            Self::Camera => normal,
            Self::OpenCv => DVec3::new(normal.x, -normal.y, -normal.z),
            Self::World { right, up, towards } => {
                DVec3::new(normal.dot(right), normal.dot(up), normal.dot(towards))
            }
        }
    }
}

/// The normals of a picture's pixels.
///
/// Of light from far away, what a surface shows depends on its normal and on the direction in which
/// it is seen, whatever its shape, but for what the shape itself hides or mirrors. So a picture of
/// any shape of one material, sorted by normals, is a picture of a ball: [`Self::ball`]. Cast
/// shadows are darker than other pixels of the same normal and are left out where these are the
/// more; interreflection is not known of, and adds light in hollows.
///
/// ```
/// use lobes::glam::DVec3;
/// use lobes::picture::{NormalFrame, Normals, Picture};
/// // A smooth bulge: x and y of the normal from the place, before a black background.
/// let side = 200;
/// let at = |i: usize| ((i % side) as f64 / 99.5 - 1.0, 1.0 - (i / side) as f64 / 99.5);
/// let normals: Vec<[f64; 3]> = (0..side * side)
///     .map(|i| {
///         let (x, y) = at(i);
///         let (x, y) = (1.1 * x, 1.1 * y);
///         let square = 1.0 - x * x - y * y;
///         if square > 0.0 { [x, y, square.sqrt()] } else { [0.0; 3] }
///     })
///     .collect();
/// let shown = normals.iter().map(|n| [0.5 + 0.4 * n[1]; 3]).collect();
/// let picture = Picture::linear(side, side, shown)?;
/// let normals = Normals::new(side, side, &normals, NormalFrame::Camera, None)?;
/// let ball = normals.ball(&picture)?;
/// assert!(ball.reach > 0.95 && ball.left_out < 0.01);
/// let sphere = ball.picture.sphere(ball.circle)?;
/// assert!((sphere.image.get(48, 48).unwrap()[0] - 0.5).abs() < 0.01);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Normals {
    width: usize,
    height: usize,
    /// Of unit length in the camera's own frame; nothing where the shape is not.
    normals: Vec<Option<DVec3>>,
}

/// The ball that shows what a shape shows.
///
/// ```
/// use lobes::picture::ShapeBall;
/// /// Whether it may be judged as a photograph of a ball is.
/// fn is_whole(ball: &ShapeBall) -> bool {
///     ball.reach >= ShapeBall::WHOLE
/// }
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeBall {
    /// A picture of it before black, seen from far away.
    pub picture: Picture,
    /// Where it is in the picture.
    pub circle: Circle,
    /// So far from the centre, in radii, the ball's normals are those of the shape; what is farther
    /// out is continued from within.
    pub reach: f64,
    /// The share of the solid angle of the normals that a far camera sees of a ball that the shape
    /// has.
    pub coverage: f64,
    /// The share of the shape's pixels that are left out, darker than others of the same normal by
    /// far.
    pub left_out: f64,
}

impl ShapeBall {
    /// The reach from which on it is a ball as a whole: beyond it nothing is read of a ball either.
    pub const WHOLE: f64 = 0.93;

    /// ν of `inference::GaussianEvidence` that fits it: more than of a
    /// ball's picture, for pixels that stand between others are interpolated. Chosen on shapes that
    /// `experiments/src/known_shapes.rs` makes.
    pub const NOISE: f64 = 1e-3;

    /// The same where only the rings near the centre are read.
    pub const NOISE_OF_PART: f64 = 3e-3;

    /// The radius in pixels.
    const RADIUS: usize = 64;

    /// Pixels a side of its picture.
    const SIDE: usize = 5 * Self::RADIUS / 2;

    /// A ring of the disc counts as shown with this share of it.
    const SHOWN: f64 = 0.9;
}

/// The largest deviation of a normal's length from 1 that codes of 8 bits and interpolation explain.
const LENGTH: f64 = 0.1;

/// The most pixels, as a share, whose normals may be of another length: the edge of an antialiased
/// map.
const SHORT: f64 = 0.05;

/// The most pixels, as a share, that may face away from the camera, and what counts as away.
const AWAY: f64 = 0.03;
const FACING: f64 = -0.1;

/// A cell of normals, two pixels of the ball wide, can have outliers with so many pixels.
const CROWD: usize = 6;

impl Normals {
    /// Normals by their components, row by row; `[0, 0, 0]` where the shape is not. `mask` tells by
    /// half or more where it is.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is a normal, and a value of the mask, for each pixel;
    /// [`Error::NotFinite`]; [`Error::Empty`] where the shape is nowhere; [`Error::Domain`] where
    /// more than 5 % of its normals are not of length 1, by more than 0.1.
    pub fn new(
        width: usize,
        height: usize,
        normals: &[[f64; 3]],
        frame: NormalFrame,
        mask: Option<&[f32]>,
    ) -> Result<Self> {
        check_length("the normals", width.saturating_mul(height), normals.len())?;
        if let Some(mask) = mask {
            check_length("the mask of the normals", normals.len(), mask.len())?;
        }
        let (mut count, mut wrong, mut length) = (0usize, 0usize, 0.0);
        let mut kept = Vec::with_capacity(normals.len());
        for (index, components) in normals.iter().enumerate() {
            let masked = mask.is_some_and(|mask| mask[index] < 0.5);
            if masked || (mask.is_none() && *components == [0.0; 3]) {
                kept.push(None);
                continue;
            }
            if let Some(value) = components.iter().find(|value| !value.is_finite()) {
                return Err(Error::NotFinite {
                    what: "the normals",
                    index,
                    value: *value,
                });
            }
            count += 1;
            let normal = DVec3::from_array(*components);
            if (normal.length() - 1.0).abs() > LENGTH {
                wrong += 1;
                length = normal.length();
                kept.push(None);
            } else {
                kept.push(Some(frame.to_camera(normal.normalize())));
            }
        }
        if count == 0 {
            return Err(Error::Empty {
                what: "a shape",
                needs: "a pixel that the mask leaves and that has a normal",
            });
        }
        if wrong as f64 > SHORT * count as f64 {
            return Err(Error::Domain {
                what: "the length of a normal",
                value: length,
                allowed: "1: components are −1 … 1 in OpenEXR, and (1 + n)/2 in the codes of a PNG",
            });
        }
        Ok(Self {
            width,
            height,
            normals: kept,
        })
    }

    /// Normals as a picture holds them: in radiance the components themselves, in codes (1 + n)/2
    /// of each. A mask of the picture counts too; in codes, without any, black is where the shape is
    /// not.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_picture(picture: &Picture, frame: NormalFrame, mask: Option<&[f32]>) -> Result<Self> {
        let (components, mut own): (Vec<[f64; 3]>, Vec<f32>) = match &picture.pixels {
            Pixels::Radiance(pixels) => {
                let there = pixels.iter().map(|n| f32::from(u8::from(*n != [0.0; 3])));
                (pixels.clone(), there.collect())
            }
            #[cfg(feature = "files")]
            Pixels::Codes(raster) => {
                let codes = (0..raster.len()).map(|index| raster.fractions(index));
                let of = |code: [f64; 3]| {
                    let there = f32::from(u8::from(code != [0.0; 3]));
                    (code.map(|value| 2.0 * value - 1.0), there)
                };
                codes.map(of).unzip()
            }
        };
        for mask in [picture.mask(), mask].into_iter().flatten() {
            check_length("the mask of the normals", own.len(), mask.len())?;
            for (own, mask) in own.iter_mut().zip(mask) {
                *own = own.min(*mask);
            }
        }
        Self::new(
            picture.width,
            picture.height,
            &components,
            frame,
            Some(&own),
        )
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The normal of a pixel in the camera's own frame; nothing where the shape is not.
    pub fn get(&self, row: usize, column: usize) -> Option<DVec3> {
        if row >= self.height || column >= self.width {
            return None;
        }
        self.normals[row * self.width + column]
    }

    /// The picture of a ball that shows what the shape shows in `picture`, as a far camera sees it.
    ///
    /// A pixel with the normal n that is seen from the direction v comes to where a far camera's
    /// ball mirrors the same direction: its normal there is along 2(n·v)n − v + z, which is n where
    /// v is z, the line of sight. So what the lobe shows is in its place, and the body's shading is
    /// taken by half of the angle between v and z aside. v is told by the focal length of the
    /// picture, in pixels; without one the camera is far away.
    ///
    /// Places of the ball that no pixel comes to, but some near, are interpolated.
    ///
    /// # Errors
    /// [`Error::NormalFrame`] where the normals are not of the frame that was said: some face away
    /// from the camera, or those at the outline do not point out of it; [`Error::Length`] where
    /// picture and normals are not of one size; [`Error::TooFew`] for a shape of less than 500
    /// pixels.
    pub fn ball(&self, picture: &Picture) -> Result<ShapeBall> {
        check_length("the normals' columns", picture.width, self.width)?;
        check_length("the normals' rows", picture.height, self.height)?;
        let seen = self.seen(picture.focal)?;
        let mut cells = self.cells(picture, &seen);
        let left_out = leave_out_shadows(&mut cells);
        let mut ball = Accumulated::new(ShapeBall::SIDE);
        for (_, pixel) in cells.iter().filter(|(_, pixel)| !pixel.dark) {
            ball.add(place(pixel.normal), pixel.rgb);
        }
        let (reach, coverage) = ball.shown();
        let filled = ball.filled();
        let middle = 0.5 * ShapeBall::SIDE as f64;
        let pixels = filled.into_iter().enumerate().map(|(index, rgb)| {
            let (row, column) = (index / ShapeBall::SIDE, index % ShapeBall::SIDE);
            let off = (row as f64 + 0.5 - middle).hypot(column as f64 + 0.5 - middle);
            if off < ShapeBall::RADIUS as f64 {
                rgb
            } else {
                [0.0; 3]
            }
        });
        let linear = Picture::linear(ShapeBall::SIDE, ShapeBall::SIDE, pixels.collect())?;
        Ok(ShapeBall {
            picture: Picture {
                ceiling: picture.ceiling,
                encoded: picture.encoded,
                ..linear
            },
            circle: Circle {
                x: middle,
                y: middle,
                radius: ShapeBall::RADIUS as f64,
            },
            reach,
            coverage,
            left_out,
        })
    }

    /// By pixel of the shape: its index and the direction from it to the camera.
    ///
    /// # Errors
    /// Normals of another frame, and too few of them.
    fn seen(&self, focal: Option<f64>) -> Result<Vec<(usize, DVec3, DVec3)>> {
        let (middle_x, middle_y) = (0.5 * self.width as f64, 0.5 * self.height as f64);
        let view = |index: usize| match focal {
            None => DVec3::Z,
            Some(focal) => {
                let x = (index % self.width) as f64 + 0.5 - middle_x;
                let y = middle_y - (index / self.width) as f64 - 0.5;
                DVec3::new(-x, -y, focal).normalize()
            }
        };
        let all: Vec<(usize, DVec3, DVec3)> = (0..self.normals.len())
            .filter_map(|index| Some((index, self.normals[index]?, view(index))))
            .collect();
        let away = all.iter().filter(|(_, n, v)| n.dot(*v) < FACING).count();
        if away as f64 > AWAY * all.len() as f64 {
            return Err(Error::NormalFrame {
                problem: "face away from the camera",
                share: away as f64 / all.len() as f64,
            });
        }
        if all.len() < 500 {
            return Err(Error::TooFew {
                what: "reading a shape",
                items: "pixels",
                needed: 500,
                got: all.len(),
            });
        }
        // Along the outline, where the surface turns away, normals point out of it.
        let (mut turned, mut wrong) = (0usize, 0usize);
        for (index, normal, view) in &all {
            let outward = self.outward(*index);
            if outward != DVec3::ZERO && normal.dot(*view).abs() < 0.5 {
                turned += 1;
                let across = DVec3::new(normal.x, normal.y, 0.0).normalize_or_zero();
                wrong += usize::from(across.dot(outward) < 0.5);
            }
        }
        if turned >= 20 && wrong as f64 > 0.25 * turned as f64 {
            return Err(Error::NormalFrame {
                problem: "do not point out of the outline where they stand on it",
                share: wrong as f64 / turned as f64,
            });
        }
        let within = all.into_iter().filter(|(_, n, v)| n.dot(*v) > 0.0);
        Ok(within.collect())
    }

    /// From a pixel at the outline the direction out of it, x to the right and y up; zero within the
    /// shape and at the picture's border.
    fn outward(&self, index: usize) -> DVec3 {
        let (row, column) = ((index / self.width) as isize, (index % self.width) as isize);
        let mut out = DVec3::ZERO;
        let mut beside = false;
        for y in -2isize..=2 {
            for x in -2isize..=2 {
                let (row, column) = (row + y, column + x);
                let inside = (0..self.height as isize).contains(&row)
                    && (0..self.width as isize).contains(&column);
                if !inside {
                    return DVec3::ZERO;
                }
                if self.normals[row as usize * self.width + column as usize].is_none() {
                    out += DVec3::new(x as f64, -y as f64, 0.0);
                    beside |= x.abs() <= 1 && y.abs() <= 1;
                }
            }
        }
        if beside {
            out.normalize_or_zero()
        } else {
            DVec3::ZERO
        }
    }

    /// The pixels with the cell of normals that each lies in, in the cells' order.
    fn cells(&self, picture: &Picture, seen: &[(usize, DVec3, DVec3)]) -> Vec<(usize, Pixel)> {
        let mut cells: Vec<(usize, Pixel)> = seen
            .iter()
            .map(|(index, normal, view)| {
                let mirrored = 2.0 * normal.dot(*view) * *normal - *view;
                let half = (mirrored + DVec3::Z).normalize_or(DVec3::Z);
                let (x, y) = place(half);
                let cell = (0.5 * y) as usize * ShapeBall::SIDE + (0.5 * x) as usize;
                let rgb = picture.pixels.at(*index);
                let pixel = Pixel {
                    normal: half,
                    rgb,
                    dark: false,
                };
                (cell, pixel)
            })
            .collect();
        cells.sort_by_key(|(cell, _)| *cell);
        cells
    }
}

/// A pixel of the shape.
#[derive(Debug, Clone, Copy)]
struct Pixel {
    normal: DVec3,
    rgb: [f64; 3],
    dark: bool,
}

/// Where a far camera's ball shows a normal, in pixels of its picture.
fn place(normal: DVec3) -> (f64, f64) {
    let (middle, radius) = (0.5 * ShapeBall::SIDE as f64, ShapeBall::RADIUS as f64);
    (middle + radius * normal.x, middle - radius * normal.y)
}

/// Marks pixels that are far darker than most of their cell, and gives their share.
fn leave_out_shadows(cells: &mut [(usize, Pixel)]) -> f64 {
    let count = cells.len();
    let mut dark = 0usize;
    for of_cell in cells.chunk_by_mut(|a, b| a.0 == b.0) {
        if of_cell.len() < CROWD {
            continue;
        }
        let log = |pixel: &Pixel| Luminance::Rec709.of(pixel.rgb).max(1e-12).ln();
        let middle = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values[values.len() / 2]
        };
        let median = middle(of_cell.iter().map(|(_, pixel)| log(pixel)).collect());
        let off = |pixel: &Pixel| (log(pixel) - median).abs();
        let spread = 1.4826 * middle(of_cell.iter().map(|(_, pixel)| off(pixel)).collect());
        // A third darker, and beyond what else differs within the cell.
        let limit = median - (4.0 * spread).max(0.4);
        for (_, pixel) in of_cell {
            pixel.dark = log(pixel) < limit;
            dark += usize::from(pixel.dark);
        }
    }
    dark as f64 / count.max(1) as f64
}

/// A picture that is put together of pixels that fall anywhere.
struct Accumulated {
    side: usize,
    sums: Vec<[f64; 3]>,
    weights: Vec<f64>,
}

impl Accumulated {
    fn new(side: usize) -> Self {
        Self {
            side,
            sums: vec![[0.0; 3]; side * side],
            weights: vec![0.0; side * side],
        }
    }

    /// Adds a value at a place, to the four pixels about it by their nearness.
    fn add(&mut self, (x, y): (f64, f64), rgb: [f64; 3]) {
        let corners = crate::numeric::bilinear::corners(self.side, self.side, x - 0.5, y - 0.5);
        for (index, weight) in corners {
            self.weights[index] += weight;
            for (sum, value) in self.sums[index].iter_mut().zip(rgb) {
                *sum += weight * value;
            }
        }
    }

    /// Whether a value fell within a pixel and a half of one.
    fn is_near(&self, row: usize, column: usize) -> bool {
        let range = |at: usize| at.saturating_sub(1)..(at + 2).min(self.side);
        range(row).any(|row| range(column).any(|c| self.weights[row * self.side + c] > 0.25))
    }

    /// How far out the disc is shown in every ring, in radii, and the share of the solid angle of
    /// its normals that is.
    fn shown(&self) -> (f64, f64) {
        const RINGS: usize = 64;
        let mut rings = [(0usize, 0usize); RINGS];
        let (mut angle, mut all) = (0.0, 0.0);
        let middle = 0.5 * self.side as f64;
        for row in 0..self.side {
            for column in 0..self.side {
                let off = (row as f64 + 0.5 - middle).hypot(column as f64 + 0.5 - middle);
                let radius = off / ShapeBall::RADIUS as f64;
                if radius >= 1.0 {
                    continue;
                }
                let near = self.is_near(row, column);
                let ring = &mut rings[(radius * RINGS as f64) as usize];
                ring.0 += usize::from(near);
                ring.1 += 1;
                // Of normals, a pixel takes its area over the cosine.
                let part = 1.0 / (1.0 - radius * radius).sqrt();
                all += part;
                angle += if near { part } else { 0.0 };
            }
        }
        let shown = |(near, all): &(usize, usize)| *near as f64 >= ShapeBall::SHOWN * *all as f64;
        let rings = rings.iter().take_while(|ring| shown(ring)).count();
        (rings as f64 / RINGS as f64, angle / all)
    }

    /// The mean of each pixel; where nothing fell, what a coarser picture has there.
    fn filled(&self) -> Vec<[f64; 3]> {
        let coarser = (self.side > 1).then(|| {
            let side = self.side.div_ceil(2);
            let mut coarser = Self::new(side);
            for row in 0..self.side {
                for column in 0..self.side {
                    let from = row * self.side + column;
                    // No pixel counts for more than a full one: a crowd in one place is not all.
                    let weight = self.weights[from];
                    if weight > 0.0 {
                        let part = weight.min(1.0);
                        let to = (row / 2) * side + column / 2;
                        coarser.weights[to] += part;
                        for c in 0..3 {
                            coarser.sums[to][c] += part / weight * self.sums[from][c];
                        }
                    }
                }
            }
            coarser.filled()
        });
        let side = self.side.div_ceil(2);
        (0..self.side * self.side)
            .map(|index| {
                let weight = self.weights[index];
                let own = self.sums[index].map(|sum| sum / weight.max(1e-300));
                let trust = weight.min(1.0);
                let Some(coarser) = coarser.as_ref().filter(|_| trust < 1.0) else {
                    return own;
                };
                let (row, column) = ((index / self.side) as f64, (index % self.side) as f64);
                let (x, y) = (0.5 * column - 0.25, 0.5 * row - 0.25);
                let corners = crate::numeric::bilinear::corners(side, side, x, y);
                let below: [f64; 3] = std::array::from_fn(|c| {
                    corners
                        .iter()
                        .map(|(at, part)| coarser[*at][c] * part)
                        .sum()
                });
                if weight == 0.0 {
                    return below;
                }
                [0, 1, 2].map(|c| trust * own[c] + (1.0 - trust) * below[c])
            })
            .collect()
    }
}
