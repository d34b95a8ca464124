//! Coefficients of a real function on the sphere.

use crate::error::{allocate, check_length};
use crate::{Error, Result};

/// How many coefficients there are of degrees 0 … `degree` and orders |m| ≤ `orders`.
///
/// `(degree + 1)²` where `orders` ≥ `degree`. What `usize` does not hold comes out as its largest
/// value, as long as which no array is.
///
/// ```
/// use lobes::harmonics::coefficient_count;
/// assert_eq!(coefficient_count(3, 3), 16);
/// assert_eq!(coefficient_count(3, 0), 4);
/// assert_eq!(coefficient_count(usize::MAX, usize::MAX), usize::MAX);
/// ```
pub const fn coefficient_count(degree: usize, orders: usize) -> usize {
    let (l, m) = (degree as u128, orders as u128);
    let m = if m < l { m } else { l };
    saturated((m * (2 * l + 1 - m)).saturating_add(l + 1))
}

/// A number as `usize`, or its largest value.
pub(crate) const fn saturated(count: u128) -> usize {
    if count < usize::MAX as u128 {
        count as usize
    } else {
        usize::MAX
    }
}

/// Where the cosine column of order m begins.
pub(crate) const fn column_start(degree: usize, m: usize) -> usize {
    if m == 0 {
        0
    } else {
        // degree + 1 of order 0, then 2 (degree + 1 − k) for each order k = 1 … m − 1
        (degree + 1) + (m - 1) * (2 * degree + 2 - m)
    }
}

/// The coefficients of f = Σ_lm f_lm Y_l^m, for degrees l = 0 … `degree` and orders |m| ≤ `orders`.
///
/// Stored by order: for each m the degrees l = m … `degree` are contiguous, first the cosine column
/// (Y_l^m, m ≥ 0), then for m > 0 the sine column (Y_l^−m).
///
/// ```
/// use lobes::harmonics::Coefficients;
/// let mut f = Coefficients::zeros(3);
/// f.set(2, -1, 5.0)?;
/// assert_eq!(f.get(2, -1), 5.0);
/// assert_eq!(f.sine(1), [0.0, 5.0, 0.0]);
/// assert_eq!(f.as_slice().len(), 16);
/// # Ok::<(), lobes::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Stored")
)]
pub struct Coefficients {
    degree: usize,
    orders: usize,
    values: Vec<f64>,
}

/// Coefficients as files have them, not yet checked.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct Stored {
    degree: usize,
    orders: usize,
    values: Vec<f64>,
}

#[cfg(feature = "serde")]
impl TryFrom<Stored> for Coefficients {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self> {
        Self::from_vec(stored.degree, stored.orders, stored.values)
    }
}

impl Coefficients {
    /// All zero, with all orders.
    ///
    /// # Panics
    /// Where there is no memory for (degree + 1)² numbers: [`try_zeros`](Self::try_zeros) says so
    /// in an error.
    pub fn zeros(degree: usize) -> Self {
        Self::zeros_with_orders(degree, degree)
    }

    /// All zero, with the orders |m| ≤ `orders` only (at most `degree`).
    ///
    /// # Panics
    /// Where there is no memory for them: [`try_zeros`](Self::try_zeros) says so in an error.
    pub fn zeros_with_orders(degree: usize, orders: usize) -> Self {
        match Self::try_zeros(degree, orders) {
            Ok(zeros) => zeros,
            Err(error) => panic!("{error}"),
        }
    }

    /// All zero, with the orders |m| ≤ `orders` only (at most `degree`), for a degree that comes
    /// from outside.
    ///
    /// ```
    /// use lobes::{Error, harmonics::Coefficients};
    /// assert_eq!(Coefficients::try_zeros(3, 0)?.as_slice(), [0.0; 4]);
    /// assert!(matches!(Coefficients::try_zeros(usize::MAX, 1), Err(Error::Memory { .. })));
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Memory`] where there is none for so many.
    pub fn try_zeros(degree: usize, orders: usize) -> Result<Self> {
        let orders = orders.min(degree);
        Ok(Self {
            degree,
            orders,
            values: allocate("the coefficients", coefficient_count(degree, orders))?,
        })
    }

    /// From values in the order of storage.
    ///
    /// # Errors
    /// [`Error::Length`] unless there are [`coefficient_count`] of them.
    pub fn from_vec(degree: usize, orders: usize, values: Vec<f64>) -> Result<Self> {
        let orders = orders.min(degree);
        check_length(
            "the coefficients",
            coefficient_count(degree, orders),
            values.len(),
        )?;
        Ok(Self {
            degree,
            orders,
            values,
        })
    }

    /// The largest degree l.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The largest order |m|.
    pub fn orders(&self) -> usize {
        self.orders
    }

    /// f_lm; 0 for any (l, m) that is not stored.
    pub fn get(&self, l: usize, m: isize) -> f64 {
        match self.index(l, m) {
            Some(index) => self.values[index],
            None => 0.0,
        }
    }

    /// Sets f_lm.
    ///
    /// ```
    /// use lobes::{Error, harmonics::Coefficients};
    /// let mut f = Coefficients::zeros_with_orders(3, 1);
    /// f.set(3, -1, 2.0)?;
    /// assert!(matches!(f.set(3, 2, 1.0), Err(Error::NotStored { .. })));
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::NotStored`] where (l, m) is not stored: see [`index`](Self::index).
    pub fn set(&mut self, l: usize, m: isize, value: f64) -> Result<()> {
        let index = self.index(l, m).ok_or(Error::NotStored {
            degree: l,
            order: m,
            degrees: self.degree,
            orders: self.orders,
        })?;
        self.values[index] = value;
        Ok(())
    }

    /// Where f_lm is in [`as_slice`](Self::as_slice), or `None` where it is not stored: |m| > l, l
    /// beyond the degree, |m| beyond the orders.
    pub fn index(&self, l: usize, m: isize) -> Option<usize> {
        let order = m.unsigned_abs();
        if l > self.degree || order > self.orders || order > l {
            return None;
        }
        let sine = if m < 0 { self.degree + 1 - order } else { 0 };
        Some(column_start(self.degree, order) + sine + l - order)
    }

    /// All values in the order of storage.
    pub fn as_slice(&self) -> &[f64] {
        &self.values
    }

    /// All values in the order of storage.
    pub fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// The values, in the order of storage.
    pub fn into_vec(self) -> Vec<f64> {
        self.values
    }

    /// f_lm for l = m … degree at order m ≥ 0; empty where m is beyond the orders.
    pub fn cosine(&self, m: usize) -> &[f64] {
        &self.values[self.columns(m).0]
    }

    /// f_l,−m for l = m … degree at order m; empty for m = 0 and where m is beyond the orders.
    pub fn sine(&self, m: usize) -> &[f64] {
        &self.values[self.columns(m).1]
    }

    /// [`cosine`](Self::cosine), to change.
    pub fn cosine_mut(&mut self, m: usize) -> &mut [f64] {
        let range = self.columns(m).0;
        &mut self.values[range]
    }

    /// [`sine`](Self::sine), to change.
    pub fn sine_mut(&mut self, m: usize) -> &mut [f64] {
        let range = self.columns(m).1;
        &mut self.values[range]
    }

    /// The cosine and the sine column of one order, to change.
    pub fn pair_mut(&mut self, m: usize) -> (&mut [f64], &mut [f64]) {
        let (cosine, sine) = self.columns(m);
        let middle = cosine.len();
        self.values[cosine.start..sine.end].split_at_mut(middle)
    }

    fn columns(&self, m: usize) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        if m > self.orders {
            return (0..0, 0..0);
        }
        let start = column_start(self.degree, m);
        let middle = start + self.degree + 1 - m;
        let end = if m == 0 {
            middle
        } else {
            middle + self.degree + 1 - m
        };
        (start..middle, middle..end)
    }

    /// The same function cut or padded with zeros to another degree, with all orders that it has.
    ///
    /// # Panics
    /// Where there is no memory for the other degree: [`try_with_degree`](Self::try_with_degree)
    /// says so in an error.
    #[must_use]
    pub fn with_degree(&self, degree: usize) -> Self {
        match self.try_with_degree(degree) {
            Ok(other) => other,
            Err(error) => panic!("{error}"),
        }
    }

    /// [`with_degree`](Self::with_degree), for a degree that comes from outside.
    ///
    /// ```
    /// use lobes::{Error, harmonics::Coefficients};
    /// let f = Coefficients::from_vec(0, 0, vec![2.0])?;
    /// assert_eq!(f.try_with_degree(1)?.as_slice(), [2.0, 0.0]);
    /// assert!(matches!(f.try_with_degree(usize::MAX), Err(Error::Memory { .. })));
    /// # Ok::<(), lobes::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Memory`] where there is none for the other degree.
    pub fn try_with_degree(&self, degree: usize) -> Result<Self> {
        let mut other = Self::try_zeros(degree, self.orders)?;
        for m in 0..=other.orders {
            let count = (degree.min(self.degree) + 1).saturating_sub(m);
            other.cosine_mut(m)[..count].copy_from_slice(&self.cosine(m)[..count]);
            if m > 0 {
                other.sine_mut(m)[..count].copy_from_slice(&self.sine(m)[..count]);
            }
        }
        Ok(other)
    }

    /// Σ f_lm² = ∫ f² dω (Parseval); infinite where it passes the largest number, as from
    /// coefficients beyond 10¹⁵⁴.
    pub fn energy(&self) -> f64 {
        self.values.iter().map(|v| v * v).sum()
    }
}

/// Checks that two sets have the same degree and orders.
pub(crate) fn check_same_shape(a: &Coefficients, b: &Coefficients) -> Result<()> {
    if a.degree == b.degree && a.orders == b.orders {
        Ok(())
    } else {
        Err(Error::Length {
            what: "the second coefficient set",
            expected: a.values.len(),
            got: b.values.len(),
        })
    }
}
