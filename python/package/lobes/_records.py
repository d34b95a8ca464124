"""What functions give back: plain data, which can be compared, copied and pickled."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from ._files import write_exr, write_png

if TYPE_CHECKING:
    from ._lobes import Camera

Interval = tuple[float, float, float]


class _Arrays:
    """Equality of records that hold arrays: that of every field."""

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        for field in fields(self):  # type: ignore[arg-type]
            one, two = getattr(self, field.name), getattr(other, field.name)
            if not (np.array_equal(one, two) if isinstance(one, np.ndarray) else one == two):
                return False
        return True


@final
@dataclass(frozen=True, slots=True)
class PowerLaw:
    """The law B_l = k / l^(2+η)."""

    k: float
    eta: float
    eta_error: float
    """The standard error of η."""
    ln_k_error: float
    """The standard error of ln k."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class LightSpectrum(_Arrays):
    """The power spectrum of an environment map."""

    luminance: NDArray[np.float64]
    """The power of the luminance (Rec. 709), B_0 … B_degree."""
    channels: NDArray[np.float64]
    """The power of red, green and blue, (3, degree + 1)."""
    law: PowerLaw
    """The law of the luminance over the degrees 2 … 64."""
    etas: tuple[float | None, float | None, float | None]
    """η of red, green and blue; None for a channel that does not vary."""
    coherence: float | None
    """The mean correlation of red and blue: 1 where light changes in brightness only."""
    clipped_eta: float | None
    """η of the luminance with the brightest 0.2 % of the sphere clipped."""

    def _repr_html_(self) -> str:
        from ._show import spectrum_html

        return spectrum_html(self)


@final
@dataclass(frozen=True, slots=True)
class Estimate:
    """A number and its standard error."""

    value: float
    standard_error: float

    def __float__(self) -> float:
        return self.value


@final
@dataclass(frozen=True, slots=True)
class Fit:
    """A lobe and a Lambert body fitted to measurements."""

    variant: str
    diffuse: Estimate
    """ρ_d; a negative one says that the lobe does not describe the surface."""
    specular: Estimate
    """ρ_s; as for ρ_d."""
    sigma: tuple[Estimate, Estimate]
    """The widths along the tangents +x and +y; the same twice for one width."""
    residual: float
    """The root of the weighted mean of squares of cos θ_i (f − value)."""
    measurements: int
    steps: int


@final
@dataclass(frozen=True, slots=True)
class Recovered:
    """A surface recovered from its kernel."""

    diffuse: Estimate
    specular: Estimate
    sigma: Estimate


@final
@dataclass(frozen=True, slots=True, eq=False)
class Measurements(_Arrays):
    """Measured values of a BRDF, in the surface's frame."""

    lights: NDArray[np.float64]
    """Directions to the light, (count, 3)."""
    views: NDArray[np.float64]
    """Directions to the sensor, (count, 3)."""
    values: NDArray[np.float64]
    """The BRDF, per steradian."""
    weights: NDArray[np.float64]
    """The solid angle that a measurement stands for, or 1."""

    def __len__(self) -> int:
        return len(self.values)


@final
@dataclass(frozen=True, slots=True, eq=False)
class Rendering(_Arrays):
    """A picture of a sphere in linear radiance.

    It goes as it is into `Picture` and `features`, and NumPy takes it as its pixels.
    """

    pixels: NDArray[np.float64]
    """(size, size, 3), rows from the top; 0 outside of the sphere."""
    mask: NDArray[np.bool_]
    """Where the sphere is, (size, size)."""
    error: float
    """The estimated error: what one pixel in a thousand passes, relative to its value."""
    camera: Camera

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        if dtype is not None and np.dtype(dtype) != self.pixels.dtype:
            if copy is False:
                raise ValueError("another type of numbers needs a copy")
            return self.pixels.astype(dtype)
        return self.pixels.copy() if copy else self.pixels

    def write(self, path: str | os.PathLike[str], exposure: float = 1.0) -> None:
        """Writes an OpenEXR file of linear radiance, or a PNG of sRGB codes that is transparent outside of the sphere, as the name ends.

        Parameters
        ----------
        path : str or path-like
            Ends in .exr or .png.
        exposure : float
            What the radiance is multiplied by.

        Examples
        --------
        >>> import lobes, os, tempfile
        >>> sphere = lobes.Renderer(lobes.builtin()[0].resampled(32)).render(lobes.presets()[4], size=16)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     sphere.write(f"{folder}/sphere.png")
        ...     os.listdir(folder)
        ['sphere.png']
        """
        if os.fspath(path).lower().endswith(".png"):
            write_png(path, self.pixels, self.mask, exposure)
        elif os.fspath(path).lower().endswith(".exr"):
            write_exr(path, exposure * self.pixels)
        else:
            raise ValueError(f"{os.fspath(path)!r} ends in neither .exr nor .png, which are the formats that are written")

    def _repr_png_(self) -> bytes:
        from ._show import png

        return png(self.pixels, self.mask)

    def __repr__(self) -> str:
        return f"<Rendering of {len(self.pixels)} × {len(self.pixels)} pixels, error {self.error:.2g}>"


@final
@dataclass(frozen=True, slots=True)
class FinishVerdict:
    """What a reader of finishes says of one photograph."""

    finish: str | None
    """The likeliest finish, or None where "no single finish" is likelier."""
    finishes: dict[str, float]
    """The probability of each finish by name."""
    no_single_finish: float
    """The probability that no finish explains the ball: glass, or a picture of a ball."""
    sigma: Interval
    """The roughness of a surface that is not matte: 5 %, 50 % and 95 % quantiles. Below 0.02 nothing is told apart."""
    share: Interval
    """The specular share, ρ_s / (ρ_s + ρ_d): 5 %, 50 % and 95 % quantiles."""
    base_colour: tuple[Interval, Interval, Interval]
    """Red, green and blue of the body's albedo, or of a metal's reflectance, up to the light's colour: quantiles."""
    metallic: float
    """The probability that it is a metal."""
    circle: Interval
    """Where the ball was taken to be: x, y, radius in pixels."""
    saturated: float
    """The share of the ball that is saturated."""
    usable: float
    """The share of the ball that is neither saturated nor covered by a print, a seam, a hole or something before it."""
    prints: float
    """The share that is covered so."""

    def _repr_html_(self) -> str:
        from ._show import bars_html

        return bars_html({**self.finishes, "no single finish": self.no_single_finish})


@final
@dataclass(frozen=True, slots=True, eq=False)
class Verdict(_Arrays):
    """What a model says of one picture."""

    material: str | None
    """The likeliest material, or None where it is likelier none of these."""
    probabilities: dict[str, float]
    """The probability of each material by name."""
    none: float
    """The probability that it is none of these."""
    sigma: Interval
    """The roughness: 5 %, 50 % and 95 % quantiles."""
    share: Interval
    """The specular share, ρ_s / (ρ_s + ρ_d): 5 %, 50 % and 95 % quantiles."""
    posterior: NDArray[np.float64]
    """The posterior, (sigmas, shares): it sums to 1."""
    sigmas: NDArray[np.float64]
    """The roughnesses of the posterior's rows."""
    shares: NDArray[np.float64]
    """The specular shares of the posterior's columns."""
    circle: Interval
    """Where the sphere was taken to be: x, y, radius in pixels."""
    saturated: float
    """The share of the sphere that is saturated."""
    grey: bool
    """Whether it was judged without colour."""

    def _repr_html_(self) -> str:
        from ._show import bars_html

        return bars_html({**self.probabilities, "none of these": self.none})

    def __repr__(self) -> str:
        best = "none of these" if self.material is None else repr(self.material)
        probability = self.none if self.material is None else self.probabilities[self.material]
        return f"<Verdict: {best} with probability {probability:.2f}, sigma {self.sigma[1]:.3f}, share {self.share[1]:.2f}>"
