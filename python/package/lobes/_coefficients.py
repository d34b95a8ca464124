"""Coefficients of functions on the sphere, with their degree and orders."""

from __future__ import annotations

import numbers
import operator
from collections.abc import Iterator
from typing import Any, SupportsIndex, final

import numpy as np
from numpy.typing import ArrayLike, NDArray


def _count(degree: int, orders: int) -> int:
    return degree + 1 + orders * (2 * degree + 1 - orders)


@final
class Coefficients:
    """Coefficients f_lm, l ≤ degree and |m| ≤ orders, of one function or of a batch.

    `array` holds them in its last dimension, stored by order m: for each m the degrees l = m … degree, first of cos mφ, then, for m > 0, of
    sin mφ. Without a degree an array of all orders tells it by its length, (degree + 1)². NumPy's functions take coefficients as that array;
    sums, differences and multiples of coefficients are coefficients.

    Parameters
    ----------
    array : array_like, (…, count)
        Real numbers.
    degree : int, optional
        The largest l; the length tells it unless given.
    orders : int, optional
        The largest |m|; the degree unless given.

    Examples
    --------
    >>> import lobes
    >>> f = lobes.Coefficients([1.0, 2.0, 3.0, 4.0])
    >>> f, float((2 * f).get(1, -1))
    (<Coefficients of degree 1, orders 1>, 8.0)
    """

    __slots__ = ("array", "degree", "orders")

    array: NDArray[np.float64]
    degree: int
    orders: int

    def __init__(self, array: ArrayLike, degree: int | None = None, orders: int | None = None) -> None:
        values = np.asarray(array)
        if values.dtype.kind not in "fiub":
            raise TypeError(f"coefficients are real numbers, and these are of the type {values.dtype}")
        values = np.require(values, np.float64, ["C", "A"])
        if values.ndim == 0:
            raise ValueError("coefficients are an array, and this is a single number")
        count = values.shape[-1]
        if degree is None:
            degree = max(int(count**0.5 + 0.5) - 1, 0)
            if orders is not None or count != (degree + 1) ** 2:
                raise ValueError(f"{count} coefficients are not (degree + 1)² of any degree: say the degree and the orders")
        degree = _index(degree, "degree")
        orders = degree if orders is None else min(_index(orders, "orders"), degree)
        if count != _count(degree, orders):
            raise ValueError(
                f"degree {degree} with orders {orders} has {_count(degree, orders)} coefficients, and the last dimension is {count}"
            )
        self.array = values
        self.degree = degree
        self.orders = orders

    @classmethod
    def zeros(cls, degree: int, orders: int | None = None, shape: tuple[int, ...] = ()) -> Coefficients:
        """All zero, for a batch of this shape.

        Parameters
        ----------
        degree : int
        orders : int, optional
            The degree unless given.
        shape : tuple of int

        Returns
        -------
        Coefficients, (*shape, count)

        Examples
        --------
        >>> import lobes
        >>> lobes.Coefficients.zeros(3, shape=(2,))
        <Coefficients of degree 3, orders 3, batch of (2,)>
        """
        degree = _index(degree, "degree")
        orders = degree if orders is None else min(_index(orders, "orders"), degree)
        return cls(np.zeros((*shape, _count(degree, orders))), degree, orders)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the batch; () for one function."""
        return self.array.shape[:-1]

    def index(self, l: int, m: int) -> int:
        """Where f_lm is in the last dimension of `array`; an `IndexError` where it is not held.

        Parameters
        ----------
        l : int
        m : int
            Negative for sin |m|φ.

        Returns
        -------
        int

        Examples
        --------
        >>> import lobes
        >>> f = lobes.Coefficients.zeros(2)
        >>> [f.index(l, m) for l, m in [(0, 0), (1, 0), (2, 0), (1, 1), (2, 1), (1, -1), (2, -1), (2, 2), (2, -2)]]
        [0, 1, 2, 3, 4, 5, 6, 7, 8]
        """
        l, m = operator.index(l), operator.index(m)
        order = abs(m)
        if not (0 <= order <= l <= self.degree and order <= self.orders):
            raise IndexError(f"there is no coefficient l = {l}, m = {m} of degree {self.degree} and orders {self.orders}")
        start = 0 if order == 0 else self.degree + 1 + (order - 1) * (2 * self.degree + 2 - order)
        return start + (self.degree + 1 - order if m < 0 else 0) + l - order

    def get(self, l: int, m: int) -> Any:
        """f_lm of each function; 0 where |m| is beyond the orders, or l beyond the degree.

        Parameters
        ----------
        l : int
        m : int
            Negative for sin |m|φ.

        Returns
        -------
        float or ndarray, of the batch's shape

        Examples
        --------
        >>> import lobes
        >>> float(lobes.Coefficients([1.0, 2.0, 3.0, 4.0]).get(1, 0))
        2.0
        """
        l, m = operator.index(l), operator.index(m)
        if abs(m) <= l and (l > self.degree or abs(m) > self.orders):
            return np.zeros(self.shape)[()]
        return self.array[..., self.index(l, m)]

    def with_degree(self, degree: int) -> Coefficients:
        """The same functions, cut or continued with zeros, with all orders that they have.

        Parameters
        ----------
        degree : int

        Returns
        -------
        Coefficients, (…, count)

        Examples
        --------
        >>> import lobes
        >>> lobes.Coefficients([1.0, 2.0, 3.0, 4.0]).with_degree(0).array
        array([1.])
        """
        other = Coefficients.zeros(degree, self.orders, self.shape)
        least = min(self.degree, other.degree)
        for m in range(-other.orders, other.orders + 1):
            here, there = self.index(abs(m), m), other.index(abs(m), m)
            count = least + 1 - abs(m)
            if count > 0:
                other.array[..., there : there + count] = self.array[..., here : here + count]
        return other

    def __getitem__(self, key: Any) -> Coefficients:
        """Some functions of a batch."""
        key = key if isinstance(key, tuple) else (key,)
        if Ellipsis not in [one for one in key if not isinstance(one, np.ndarray)]:
            key = (*key, Ellipsis)
        return Coefficients(self.array[(*key, slice(None))], self.degree, self.orders)

    def __len__(self) -> int:
        if not self.shape:
            raise TypeError("these are the coefficients of one function, which has no length")
        return self.shape[0]

    def __iter__(self) -> Iterator[Coefficients]:
        return (self[i] for i in range(len(self)))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        if dtype is not None and np.dtype(dtype) != self.array.dtype:
            if copy is False:
                raise ValueError("another type of numbers needs a copy")
            return self.array.astype(dtype)
        return self.array.copy() if copy else self.array

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Coefficients):
            return NotImplemented
        return (self.degree, self.orders) == (other.degree, other.orders) and np.array_equal(self.array, other.array)

    # The array can be changed.
    __hash__ = None  # type: ignore[assignment]

    def _with(self, other: object, operation: Any) -> Any:
        if not isinstance(other, Coefficients):
            return NotImplemented
        if (self.degree, self.orders) != (other.degree, other.orders):
            raise ValueError(
                f"coefficients of degree {self.degree} and orders {self.orders}"
                f" and of degree {other.degree} and orders {other.orders} do not add up"
            )
        return Coefficients(operation(self.array, other.array), self.degree, self.orders)

    def _times(self, other: object, operation: Any) -> Any:
        if not isinstance(other, numbers.Real):
            return NotImplemented
        return Coefficients(operation(self.array, other), self.degree, self.orders)

    def __add__(self, other: Coefficients) -> Any:
        return self._with(other, np.add)

    def __sub__(self, other: Coefficients) -> Any:
        return self._with(other, np.subtract)

    def __mul__(self, other: float) -> Any:
        return self._times(other, np.multiply)

    def __rmul__(self, other: float) -> Any:
        return self._times(other, np.multiply)

    def __truediv__(self, other: float) -> Any:
        return self._times(other, np.divide)

    def __neg__(self) -> Coefficients:
        return Coefficients(-self.array, self.degree, self.orders)

    def __reduce__(self) -> tuple[type[Coefficients], tuple[NDArray[np.float64], int, int]]:
        return Coefficients, (self.array, self.degree, self.orders)

    def __copy__(self) -> Coefficients:
        return Coefficients(self.array.copy(), self.degree, self.orders)

    def _repr_png_(self) -> bytes | None:
        from ._show import coefficients_png

        return coefficients_png(self)

    def __repr__(self) -> str:
        batch = f", batch of {self.shape}" if self.shape else ""
        return f"<Coefficients of degree {self.degree}, orders {self.orders}{batch}>"


def _index(value: SupportsIndex, name: str) -> int:
    index = operator.index(value)
    if index < 0:
        raise ValueError(f"{name} is {index}, which is below 0")
    return index
