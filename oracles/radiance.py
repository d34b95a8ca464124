"""Radiance's own plastic and metal on a plane under a parallel beam: what its arguments (R, G, B, S, σ) mean, and its lobe of today.

Each answer is the radiance for a beam of irradiance one (per unit area across the beam): (ρ_d/π + ρ_s f) c_i. Roughnesses stay where Radiance adds no Fresnel term.
"""

import importlib.metadata
import pathlib
import tempfile

import numpy as np
import radiance_tools
from snapshot import Snapshot, uniform

ANGLE = 0.002  # degrees across: Radiance widens σ² by the source's solid angle / 4π, here 8e-11
LIGHT = 1e9
SOLID_ANGLE = 2 * np.pi * (1 - np.cos(np.radians(ANGLE / 2)))

u = iter(0.5 * (np.array(uniform(800, 5000)) + 1.0))


def direction(cosine, azimuth):
    sine = np.sqrt(1 - cosine**2)
    return np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine])


def radiances(material, light, views):
    scene = f"""void light beam 0 0 3 {LIGHT} {LIGHT} {LIGHT}
beam source sun 0 0 4 {light[0]:.17g} {light[1]:.17g} {light[2]:.17g} {ANGLE}
void {material[0]} surface 0 0 5 {" ".join(f"{value:.17g}" for value in material[1:])}
surface polygon plane 0 0 12 -9 -9 0 9 -9 0 9 9 0 -9 9 0
"""
    rays = "".join(" ".join(f"{x:.17g}" for x in (*view, *-view)) + "\n" for view in views)
    with tempfile.TemporaryDirectory() as folder:
        scene_path, octree = pathlib.Path(folder) / "scene.rad", pathlib.Path(folder) / "scene.oct"
        scene_path.write_text(scene)
        octree.write_bytes(radiance_tools.run("oconv", scene_path))
        options = "-h -ab 0 -dj 0 -ds 0 -dt 0 -dc 1 -st 0 -ss 0 -lr 0 -as 0 -aa 0".split()
        out = radiance_tools.run("rtrace", *options, "-faf", octree, input=rays.encode())
    values = np.frombuffer(out, dtype=np.float32).reshape(-1, 3).astype(float)
    return values / (LIGHT * SOLID_ANGLE)


# A matte surface says whether the beam is what it should be.
matte = radiances(("plastic", 0.5, 0.25, 0.125, 0, 0), direction(0.6, 0.0), [direction(0.9, 1.0)])[0]
assert np.abs(matte / (np.array([0.5, 0.25, 0.125]) * 0.6 / np.pi) - 1).max() < 1e-5, matte

snapshot = Snapshot(
    __file__,
    oracle={"Radiance": radiance_tools.release(), "pyradiance": importlib.metadata.version("pyradiance")},
    precision="single",
    tolerance=1e-5,
)
for material in (
    ("plastic", 0.6, 0.3, 0.1, 0.05, 0.05),
    ("plastic", 0.2, 0.5, 0.8, 0.04, 0.2),
    ("metal", 0.6, 0.3, 0.1, 0.9, 0.05),
    ("metal", 0.9, 0.8, 0.5, 0.75, 0.1),
    ("metal", 0.2, 0.5, 0.8, 0.5, 0.3),
):
    sigma = material[-1]
    for _ in range(5):
        light = direction(0.15 + 0.85 * next(u), 2 * np.pi * next(u))
        views = []
        while len(views) < 6:
            slope, turn = 2.5 * sigma * next(u), 2 * np.pi * next(u)
            half = np.array([slope * np.cos(turn), slope * np.sin(turn), 1.0])
            half /= np.linalg.norm(half)
            view = 2 * (half @ light) * half - light
            if view[2] > 0.1:
                views.append(view)
        snapshot.case(
            material[0], reflectance=material[1:4], specularity=material[4], sigma=sigma, light=light, views=views,
            radiances=radiances(material, light, views),
        )  # fmt: skip
snapshot.write()
