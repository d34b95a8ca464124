//! How far the outline of a sphere is from round.

use std::f64::consts::PI;

use nalgebra::{SMatrix, SVector};

use super::Circle;
use super::edges::{Edge, Edges};
use super::reduced::Reduced;
use super::{FINE, SMALL};
use crate::picture::Picture;

/// An outline that is longer in one direction than across it.
///
/// ```
/// use lobes::picture::{Circle, Picture};
///
/// // A disc that was squashed to nine tenths of its height.
/// let inside = |x: f64, y: f64| (x - 80.0).hypot((y - 80.0) / 0.9) < 60.0;
/// let pixels = (0..160 * 160).map(|i| {
///     let dark = inside((i % 160) as f64 + 0.5, (i / 160) as f64 + 0.5);
///     [if dark { 0.1 } else { 0.8 }; 3]
/// });
/// let picture = Picture::linear(160, 160, pixels.collect())?;
/// let circle = Circle { x: 80.0, y: 80.0, radius: 57.0 };
/// let elongation = picture.elongation(circle).unwrap();
/// assert!((elongation.ratio - 1.0 / 0.9).abs() < 0.01);
/// assert!(elongation.angle.abs() < 0.05);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elongation {
    /// The longest diameter over the shortest.
    pub ratio: f64,
    /// The direction of the longest, in radians from the right towards the bottom, −π/2 … π/2.
    pub angle: f64,
}

/// Edges are heeded so far from the circle, as a share of its radius.
const REACH: f64 = 0.18;

/// At least so many of 36 parts of the outline must have an edge.
const LEAST_PARTS: usize = 20;

/// A lens that shows more than this one, as a focal length on film of 36 × 24 mm, is rare.
const WIDE_LENS: f64 = 28.0;

impl Picture {
    /// How far the outline about a circle is from round; nothing where too little of it is to be
    /// seen.
    ///
    /// An ellipse of small elongation, r(φ) = r + a cos φ + b sin φ + c cos 2φ + d sin 2φ, is fitted to the edges near
    /// the circle that run along it, by least squares with Tukey's weights.
    pub fn elongation(&self, circle: Circle) -> Option<Elongation> {
        let side = self.width().min(self.height());
        // Of a small sphere in a large picture a pixel must not be too much.
        let coarse = (side / SMALL).max(1);
        let scale = coarse
            .min((circle.radius / 40.0) as usize)
            .max(side.div_ceil(2 * FINE))
            .max(1);
        let edges = Edges::of(&Reduced::of(self, scale));
        let [c, d] = second_harmonic(&edges.edges, circle.times(1.0 / scale as f64))?;
        let size = c.hypot(d);
        Some(Elongation {
            ratio: (1.0 + size) / (1.0 - size),
            angle: 0.5 * d.atan2(c),
        })
    }

    /// How much of an elongation perspective leaves unexplained, as a ratio of diameters: a lens draws a sphere
    /// that is off its axis longer towards it.
    ///
    /// A sphere whose centre is seen θ off the axis and whose radius under α is an ellipse of the
    /// ratio cos α / √(cos² θ − sin² α), long in the direction of the picture's middle. Where the
    /// focal length is not known, any from that of a wide lens (28 mm on film of 36 × 24 mm) on may
    /// have been it.
    pub fn unexplained(&self, circle: Circle, elongation: Elongation) -> f64 {
        let (width, height) = (self.width() as f64, self.height() as f64);
        let (x, y) = (circle.x - 0.5 * width, circle.y - 0.5 * height);
        let focal = self
            .focal_length()
            .unwrap_or(WIDE_LENS / 36f64.hypot(24.0) * width.hypot(height));
        let off = x.hypot(y);
        let cos = focal / focal.hypot(off);
        // The radius is seen under about r cos² θ / f.
        let sin = (circle.radius * cos * cos / focal).min(0.9 * cos);
        let expected = ((1.0 - sin * sin) / (cos * cos - sin * sin)).sqrt().ln();
        let twice = 2.0 * y.atan2(x);
        let (px, py) = (expected * twice.cos(), expected * twice.sin());
        let found = elongation.ratio.ln();
        let (fx, fy) = (
            found * (2.0 * elongation.angle).cos(),
            found * (2.0 * elongation.angle).sin(),
        );
        let part = if self.focal_length().is_some() {
            1.0
        } else {
            ((fx * px + fy * py) / (px * px + py * py).max(1e-12)).clamp(0.0, 1.0)
        };
        (fx - part * px).hypot(fy - part * py).exp()
    }
}

/// c and d over r, of the ellipse that most edges near a circle lie on.
fn second_harmonic(edges: &[Edge], circle: Circle) -> Option<[f64; 2]> {
    let reach = REACH * circle.radius + 1.0;
    let near: Vec<(f64, f64, f64)> = edges
        .iter()
        .filter_map(|edge| {
            let (off, cosine) = edge.against(circle);
            let angle = (edge.y - circle.y).atan2(edge.x - circle.x);
            (off.abs() < reach && cosine > 0.9).then_some((angle, off, edge.strength))
        })
        .collect();
    let shape = |angle: f64| {
        SVector::<f64, 5>::from([
            1.0,
            angle.cos(),
            angle.sin(),
            (2.0 * angle).cos(),
            (2.0 * angle).sin(),
        ])
    };
    let mut fitted = SVector::<f64, 5>::zeros();
    let mut width = 0.08 * circle.radius + 0.5;
    for _ in 0..24 {
        let mut normal = SMatrix::<f64, 5, 5>::zeros();
        let mut right = SVector::<f64, 5>::zeros();
        for (angle, off, strength) in &near {
            let row = shape(*angle);
            let left = off - row.dot(&fitted);
            let part = 1.0 - (left / (2.0 * width)).powi(2);
            if part > 0.0 {
                let weight = strength * part * part;
                normal += weight * row * row.transpose();
                right += weight * *off * row;
            }
        }
        fitted = normal.cholesky()?.solve(&right);
        width = (0.85 * width).max(0.01 * circle.radius + 0.4);
    }
    let mut seen = [false; 36];
    for (angle, off, _) in &near {
        if (off - shape(*angle).dot(&fitted)).abs() < 2.0 * width {
            let part = (angle / (2.0 * PI) + 0.5) * 36.0;
            seen[(part as usize).min(35)] = true;
        }
    }
    let parts = seen.iter().filter(|seen| **seen).count();
    let radius = circle.radius + fitted[0];
    let harmonic = [fitted[3] / radius, fitted[4] / radius];
    (parts >= LEAST_PARTS && harmonic[0].hypot(harmonic[1]) < 0.3).then_some(harmonic)
}
