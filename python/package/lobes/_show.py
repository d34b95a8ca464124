"""How maps, spheres, pictures, coefficients, spectra and verdicts look in a notebook."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ._lobes import EnvironmentMap, Transform, encode_png, linear_of_srgb

if TYPE_CHECKING:
    from ._coefficients import Coefficients
    from ._records import LightSpectrum

ROWS = 256
# Read on white and on black.
INK, COLOURS, LAW = "#808080", ("#d04040", "#30a050", "#4070e0"), "#e0a020"
BLUE, WHITE, RED = (np.array(rgb) / 255 for rgb in [(33, 102, 172), (247, 247, 247), (178, 24, 43)])


def png(pixels: NDArray[np.float64], mask: NDArray[np.bool_] | NDArray[np.float64] | None = None) -> bytes:
    """Linear radiance, exposed so that one pixel in fifty is white."""
    shown = pixels if mask is None else pixels[np.asarray(mask, np.float64) > 0.5]
    bright = float(np.percentile(shown.max(axis=-1), 98)) if shown.size else 0.0
    return encode_png(pixels, mask, 1 / bright if bright > 1e-300 else 1.0)


def map_png(light: EnvironmentMap) -> bytes:
    """A map, of no more rows than a screen shows."""
    return png((light.resampled(ROWS) if light.shape[0] > ROWS else light).pixels)


def coefficients_png(coefficients: Coefficients) -> bytes | None:
    """Three functions as red, green and blue, one from blue below 0 to red above it, each as a lat-long map; None of other batches."""
    if coefficients.shape not in [(), (3,)]:
        return None
    rings = ROWS // 2
    shown = coefficients.with_degree(min(coefficients.degree, rings - 1))
    if shown.orders < shown.degree:
        shown = type(shown)(_all_orders(shown))
    field = Transform("lat-long", rings, 2 * rings, shown.degree).synthesise(shown)
    if field.ndim == 3:
        return png(np.moveaxis(field, 0, -1).clip(min=0))
    share = (field / max(float(np.abs(field).max()), 1e-300))[..., None]
    codes = WHITE + np.abs(share) * (np.where(share < 0, BLUE, RED) - WHITE)
    return encode_png(linear_of_srgb(codes), None, 1.0)


def _all_orders(coefficients: Coefficients) -> NDArray[np.float64]:
    # Stored by order: the orders that are not there come last.
    missing = (coefficients.degree + 1) ** 2 - coefficients.array.shape[-1]
    return np.concatenate([coefficients.array, np.zeros((*coefficients.shape, missing))], axis=-1)


def _svg(width: int, height: int, parts: list[str]) -> str:
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
    return f'{head} font-family="sans-serif" font-size="12" fill="{INK}">' + "".join(parts) + "</svg>"


def spectrum_html(spectrum: LightSpectrum) -> str:
    """The power of each channel by degree, both logarithmic, and the luminance's law."""
    width, height, left, right, bottom, top = 420, 290, 52, 16, 40, 12
    degrees = np.arange(1, len(spectrum.luminance))
    law = spectrum.law.k / degrees ** (2 + spectrum.law.eta)
    lines = [*zip(COLOURS, spectrum.channels[:, 1:], strict=True), (LAW, law)]
    positive = np.concatenate([values[values > 0] for _, values in lines])
    if positive.size == 0 or len(degrees) < 2:
        return "<p>a spectrum without power</p>"
    low, high = math.floor(math.log10(positive.min())), math.ceil(math.log10(positive.max()))
    low = max(low, high - 12)
    last = math.log10(degrees[-1])

    def place(l: float, power: float) -> str:
        x = left + (width - left - right) * math.log10(l) / last
        y = top + (height - top - bottom) * (high - max(math.log10(power), low)) / max(high - low, 1)
        return f"{x:.1f},{y:.1f}"

    parts = []
    for decade in range(low, high + 1):
        x, y = place(1, 10.0**decade).split(",")
        parts.append(
            f'<path d="M{x},{y}H{width - right}" stroke="{INK}" stroke-opacity="0.3"/>'
            f'<text x="{left - 6}" y="{float(y) + 4:.1f}" text-anchor="end">10{_raised(decade)}</text>'
        )
    for l in [2**power for power in range(len(degrees).bit_length())]:
        x = place(l, 10.0**low).split(",")[0]
        parts.append(f'<text x="{x}" y="{height - bottom + 16}" text-anchor="middle">{l}</text>')
    for colour, values in lines:
        points = " ".join(place(l, power) for l, power in zip(degrees.tolist(), values.tolist(), strict=True) if power > 0)
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
    parts.append(f'<text x="{left}" y="{height - 6}">power by degree l; <tspan fill="{LAW}">k / l^{2 + spectrum.law.eta:.2f}</tspan></text>')
    return _svg(width, height, parts)


def _raised(number: int) -> str:
    return str(number).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def bars_html(probabilities: Mapping[str, float]) -> str:
    """Probabilities by name."""
    step, left, length = 20, 130, 200
    parts = []
    for row, (name, probability) in enumerate(probabilities.items()):
        y = row * step
        parts.append(
            f'<text x="{left - 8}" y="{y + 14}" text-anchor="end">{html.escape(name)}</text>'
            f'<rect x="{left}" y="{y + 3}" width="{length * probability:.1f}" height="14" fill="{COLOURS[2]}"/>'
            f'<text x="{left + length * probability + 6:.1f}" y="{y + 14}">{probability:.2f}</text>'
        )
    return _svg(left + length + 50, step * len(probabilities), parts)
