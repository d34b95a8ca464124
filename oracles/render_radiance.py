"""Spheres under captured light by Radiance, with the Monte Carlo error of each pixel.

The sphere is Radiance's own plastic or metal, the map a glow all around, given as numbers between which Radiance interpolates as the crate does. Each
pixel is the mean over its area of 32 pictures, and its error is theirs over √32. Radiance draws its samples from one sequence, so the rays
of all pictures go through one process in random order. Only pixels that lie well inside the sphere are kept.
"""

import importlib.metadata
import pathlib
import sys
import tempfile

import numpy as np
import radiance_tools
from snapshot import ROOT, Snapshot

SIZE, PICTURES, RAYS = 12, 32, 32
LOBE_SAMPLES, BODY_SAMPLES = 16, 64  # of each ray


def read_map(name):
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    bitmap = mi.Bitmap(str(ROOT / "data" / "illuminations" / f"{name}.exr"))
    return np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)).astype(float)


def write_scene(folder, pixels, material):
    """The map bilinear between the centres of its pixels: a row of the other side past each pole, a column of the other end past each end."""
    height, width = pixels.shape[:2]
    top, bottom = (np.roll(pixels[row], width // 2, axis=0)[None] for row in (0, -1))
    padded = np.concatenate([top, pixels, bottom])
    padded = np.concatenate([padded[:, -1:], padded, padded[:, :1]], axis=1)
    for channel, name in enumerate("rgb"):
        numbers = "\n".join(" ".join(f"{value:.9g}" for value in row) for row in padded[..., channel])
        (folder / f"{name}.dat").write_text(f"2\n0 {height + 1} {height + 2}\n0 {width + 1} {width + 2}\n{numbers}\n")
    (folder / "map.cal").write_text(
        f"row = acos(Dy) * {height} / PI + 0.5;\ncolumn = (atan2(Dx, -Dz) / (2 * PI) + 0.5) * {width} + 0.5;\nsame(x) = x;\n"
    )
    (folder / "scene.rad").write_text(
        f"""void colordata light 9 same same same ./r.dat ./g.dat ./b.dat ./map.cal row column 0 0
light glow sky 0 0 4 1 1 1 0
sky source around 0 0 4 0 1 0 360
void {material[0]} surface 0 0 5 {" ".join(f"{value:.17g}" for value in material[1:])}
surface sphere ball 0 0 4 0 0 0 1
"""
    )
    (folder / "scene.oct").write_bytes(radiance_tools.run("oconv", "scene.rad", cwd=folder))


def render(pixels, material, kept, seed):
    """The mean of each kept pixel in each picture."""
    generator = np.random.Generator(np.random.PCG64(seed))
    row, column = np.array(kept).T
    shape = (PICTURES, RAYS, len(kept))
    x = (column + generator.random(shape)) * 2 / SIZE - 1
    y = 1 - (row + generator.random(shape)) * 2 / SIZE
    rays = np.stack([x, y, np.full(shape, 5.0), np.zeros(shape), np.zeros(shape), np.full(shape, -1.0)], axis=-1).reshape(-1, 6)
    order = generator.permutation(len(rays))
    options = f"-h -w -ab 1 -ad {BODY_SAMPLES} -as 0 -aa 0 -ss {LOBE_SAMPLES} -st 0 -dj 0 -dt 0 -dc 1 -lr 4 -lw 0".split()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        write_scene(folder, pixels, material)
        out = radiance_tools.run("rtrace", *options, "-ffd", "scene.oct", input=rays[order].astype(np.float32).tobytes(), cwd=folder)
    values = np.empty((len(rays), 3))
    values[order] = np.frombuffer(out, dtype=np.float64).reshape(-1, 3)
    return values.reshape(*shape, 3).mean(axis=1)


kept = []
for row in range(SIZE):
    for column in range(SIZE):
        half = SIZE / 2
        x, y = max(abs(column - half), abs(column + 1 - half)) / half, max(abs(row - half), abs(row + 1 - half)) / half
        if x * x + y * y < 0.85:
            kept.append((row, column))

if __name__ == "__main__":
    snapshot = Snapshot(
        __file__,
        oracle={"Radiance": radiance_tools.release(), "pyradiance": importlib.metadata.version("pyradiance")},
        precision=f"single; Monte Carlo, {PICTURES * RAYS} rays a pixel",
        tolerance=0.05,
    )
    for light in ("pmndrs-venice", "blender-forest"):
        pixels = read_map(light)
        for seed, material in enumerate(
            (("plastic", 0.6, 0.3, 0.1, 0.0, 0.0), ("plastic", 0.3, 0.15, 0.08, 0.05, 0.05), ("metal", 0.9, 0.7, 0.5, 0.9, 0.1), ("metal", 0.8, 0.8, 0.8, 0.5, 0.3))
        ):
            pictures = render(pixels, material, kept, seed)
            mean, error = pictures.mean(axis=0), pictures.std(axis=0, ddof=1) / np.sqrt(PICTURES)
            snapshot.case(
                "sphere", light=light, kind=material[0], reflectance=material[1:4], specularity=material[4], sigma=material[5],
                size=SIZE, pictures=PICTURES, pixels=kept,
                values=[[float(f"{v:.6g}") for v in p] for p in mean], errors=[[float(f"{v:.3g}") for v in p] for p in error],
            )  # fmt: skip
    snapshot.write()
