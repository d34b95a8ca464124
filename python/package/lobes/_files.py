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
    """Writes linear radiance, (rows, columns, 3), as OpenEXR."""
    _write_whole(path, encode_exr(pixels, precision))


def write_png(
    path: str | os.PathLike[str], pixels: ArrayLike, mask: ArrayLike | None = None, exposure: float = 1.0
) -> None:
    """Writes linear radiance, (rows, columns, 3), times the exposure as a PNG of 8-bit sRGB, transparent where the mask is 0."""
    _write_whole(path, encode_png(pixels, mask, exposure))
