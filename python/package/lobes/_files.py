"""Writing pictures: whole, or not at all."""

from __future__ import annotations

import os
import tempfile
from typing import Literal

from numpy.typing import ArrayLike

from ._lobes import encode_exr, encode_png


def _write_whole(path: str | os.PathLike[str], data: bytes) -> None:
    """Writes beside the file's place first, then moves it there."""
    folder, name = os.path.split(os.fspath(path))
    handle, aside = tempfile.mkstemp(prefix=f".{name}-", suffix="-partial", dir=folder or ".")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        # As open() would have left it.
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(aside, 0o666 & ~mask)
        os.replace(aside, path)
    except BaseException:
        os.unlink(aside)
        raise


def write_exr(path: str | os.PathLike[str], pixels: ArrayLike, precision: Literal["single", "half"] = "single") -> None:
    """Writes linear radiance as OpenEXR, whole or not at all.

    Parameters
    ----------
    path : str or path-like
    pixels : array_like, (rows, columns, 3)
    precision : str
        "single" or "half".

    Examples
    --------
    >>> import lobes, numpy as np, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     lobes.write_exr(f"{folder}/grey.exr", np.full((2, 3, 3), 0.25))
    ...     float(lobes.read_linear(f"{folder}/grey.exr").max())
    0.25
    """
    _write_whole(path, encode_exr(pixels, precision))


def write_png(
    path: str | os.PathLike[str], pixels: ArrayLike, mask: ArrayLike | None = None, exposure: float = 1.0
) -> None:
    """Writes linear radiance as a PNG of 8-bit sRGB, whole or not at all.

    Parameters
    ----------
    path : str or path-like
    pixels : array_like, (rows, columns, 3)
    mask : array_like, (rows, columns), optional
        The picture is transparent where it is 0.
    exposure : float
        What the radiance is multiplied by.

    Examples
    --------
    >>> import lobes, numpy as np, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     lobes.write_png(f"{folder}/grey.png", np.full((2, 3, 3), 0.25))
    ...     lobes.Picture.read(f"{folder}/grey.png").pixels.shape
    (2, 3, 3)
    """
    _write_whole(path, encode_png(pixels, mask, exposure))
