"""Spheres under captured light by Mitsuba, with the Monte Carlo error of each pixel.

Light, material and sphere are those of `render_tools`; the map goes in on four times its pixels, which costs less than a tenth of the Monte Carlo
error. Each pixel is the mean over its area of 32 pictures of 1024 samples, and its error is theirs over √32; only pixels that lie
well inside the sphere are kept. Where there is no LLVM for Mitsuba (libllvm19 in Debian) the script is skipped.
"""

import sys

from snapshot import Snapshot, skip

if "--help" not in sys.argv:
    import render_tools

    if render_tools.VARIANT == "scalar_rgb":
        skip("Mitsuba finds no LLVM 16 or newer; name one in DRJIT_LIBLLVM_PATH")

SIZE, PICTURES, SAMPLES = 16, 32, 1024

snapshot = Snapshot(__file__, oracle=["mitsuba", "drjit"], precision="single; Monte Carlo, 32768 samples a pixel", tolerance=0.05)
kept = render_tools.well_inside(SIZE)
for light in ("pmndrs-venice", "blender-forest"):
    emitter = render_tools.emitter(render_tools.read_map(light))
    for diffuse, specular, sigma in (
        ((0.6, 0.3, 0.1), (0.0, 0.0, 0.0), 0.1),
        ((0.28, 0.15, 0.08), (0.05, 0.05, 0.05), 0.05),
        ((0.08, 0.06, 0.05), (0.72, 0.6, 0.5), 0.1),
        ((0.0, 0.0, 0.0), (0.9, 0.9, 0.9), 0.3),
    ):
        scene = render_tools.scene(emitter, diffuse, specular, sigma, SIZE)
        mean, error = render_tools.estimate(scene, SAMPLES, PICTURES)
        snapshot.case(
            "sphere", light=light, diffuse=diffuse, specular=specular, sigma=sigma, size=SIZE, pictures=PICTURES, pixels=kept,
            values=[[float(f"{v:.6g}") for v in mean[p]] for p in kept], errors=[[float(f"{v:.3g}") for v in error[p]] for p in kept],
        )  # fmt: skip
snapshot.write()
