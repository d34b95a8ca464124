//! Parts of cells, where the light is bilinear.

use fearless_simd::{f64x8, prelude::*};

use super::opening::Patches;
use super::small_angles::small_sin_cos;
use super::tree::LightTree;

/// A part of a cell: the row and the column of the cell, where its middle is from −1 to 1, and half
/// its sides over the cell's.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    pub(super) row: u32,
    pub(super) column: u32,
    pub(super) y: f32,
    pub(super) x: f32,
    pub(super) height: f32,
    pub(super) width: f32,
}

/// The light of eight parts: at the corners of their cells, and where in those they are.
pub(super) struct PartLight<S: Simd> {
    pub(super) patches: Patches<S>,
    pub(super) y: f64x8<S>,
    pub(super) x: f64x8<S>,
    pub(super) height: f64x8<S>,
    pub(super) width: f64x8<S>,
    /// Of each channel: above before, above after, below before, below after.
    pub(super) corners: [[f64x8<S>; 4]; 3],
}

impl LightTree {
    /// Eight parts; those past the end repeat the last without light.
    #[inline(always)]
    pub(super) fn gather<S: Simd>(&self, simd: S, parts: &[Part]) -> PartLight<S> {
        let mut corners = [[[0.0; 8]; 4]; 3];
        let mut place = [[0.0; 8]; 4];
        let mut trig = [[0.0; 8]; 4];
        let stride = self.columns + 1;
        for lane in 0..8 {
            let part = parts[lane.min(parts.len() - 1)];
            let (row, column) = (part.row as usize, part.column as usize);
            place[0][lane] = f64::from(part.y);
            place[1][lane] = f64::from(part.x);
            place[2][lane] = f64::from(part.height);
            place[3][lane] = f64::from(part.width);
            (trig[0][lane], trig[1][lane]) = self.row_middle[row];
            (trig[2][lane], trig[3][lane]) = self.column_middle[column];
            if lane < parts.len() {
                let at = row * stride + column;
                for (corner, index) in [at, at + 1, at + stride, at + stride + 1]
                    .into_iter()
                    .enumerate()
                {
                    let pixel = self.pixels[index];
                    for channel in 0..3 {
                        corners[channel][corner][lane] = pixel[channel];
                    }
                }
            }
        }
        let [red, green, blue] = &corners;
        let light = [four(simd, red), four(simd, green), four(simd, blue)];
        let [y, x, height, width] = four(simd, &place);
        let [sin, cos, sin_turn, cos_turn] = four(simd, &trig);
        let half = 0.5 * self.step;
        let (sin_y, cos_y) = small_sin_cos(simd, y * half);
        let (sin_x, cos_x) = small_sin_cos(simd, x * half);
        let (sin, cos) = (
            sin.mul_add(cos_y, cos * sin_y),
            cos.mul_add(cos_y, -(sin * sin_y)),
        );
        let (sin_turn, cos_turn) = (
            sin_turn.mul_add(cos_x, cos_turn * sin_x),
            cos_turn.mul_add(cos_x, -(sin_turn * sin_x)),
        );
        PartLight {
            patches: Patches {
                centre: [sin * cos_turn, sin * sin_turn, cos],
                sin: sin.abs(),
                half: [height * half, width * half],
            },
            y,
            x,
            height,
            width,
            corners: light,
        }
    }

    /// The sines and cosines of the middles of the cells of eight parts.
    #[inline(always)]
    pub(super) fn middles<S: Simd>(&self, simd: S, eight: &[Part]) -> [f64x8<S>; 4] {
        let mut trig = [[0.0; 8]; 4];
        for lane in 0..8 {
            let part = eight[lane.min(eight.len() - 1)];
            (trig[0][lane], trig[1][lane]) = self.row_middle[part.row as usize];
            (trig[2][lane], trig[3][lane]) = self.column_middle[part.column as usize];
        }
        four(simd, &trig)
    }
}

/// Four vectors. (The closure of an array's `map` would be compiled without vector instructions.)
#[inline(always)]
fn four<S: Simd>(simd: S, [a, b, c, d]: &[[f64; 8]; 4]) -> [f64x8<S>; 4] {
    [
        f64x8::from_slice(simd, a),
        f64x8::from_slice(simd, b),
        f64x8::from_slice(simd, c),
        f64x8::from_slice(simd, d),
    ]
}
