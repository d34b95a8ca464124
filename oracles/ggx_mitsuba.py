"""GGX lobes as Mitsuba's `roughconductor`, `roughdielectric` and `principled` give them, and a white furnace of its visible normals.

Mitsuba masks and shadows each by itself, G1(v) G1(i), where the crate's lobe has the two correlated by height: what is written are Mitsuba's own values, and
the contract takes the one factor for the other, G1(v) being G2 of v and the normal. The furnace draws with Mitsuba's distribution and weighs with
G2/G1, G2 made of Mitsuba's G1; with the separable G2 it has to agree with the plugin's own weights.

Needs a vectorised variant of Mitsuba, so LLVM 19 or newer: Debian's libllvm19, or DRJIT_LIBLLVM_PATH. Without it the script says so and the old
snapshot stays.
"""

import subprocess
import sys

import numpy as np
from snapshot import Snapshot, skip, uniform

PROBE = "import mitsuba, drjit; mitsuba.set_variant('llvm_ad_rgb'); print(drjit.sum(drjit.arange(mitsuba.Float, 4)))"
if subprocess.run([sys.executable, "-c", PROBE], capture_output=True).returncode != 0:
    skip("Mitsuba's llvm_ad_rgb does not run here: install libllvm19, or set DRJIT_LIBLLVM_PATH to a libLLVM.so of 19 or newer")

import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")

ALPHAS = [(0.01, 0.01), (0.1, 0.1), (0.5, 0.5), (0.1, 0.4)]


def plugins(alpha):
    """The crate's name of the reflectance, its parameters, and Mitsuba's plugin."""
    microfacets = {"distribution": "ggx", "alpha_u": alpha[0], "alpha_v": alpha[1]}
    yield "constant", [1.0], {"type": "roughconductor", "material": "none", **microfacets}
    yield "conductor", [0.47, 2.4], {"type": "roughconductor", "eta": 0.47, "k": 2.4, **microfacets}
    if alpha[0] == alpha[1]:
        yield "dielectric", [1.5], {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha[0], "int_ior": 1.5, "ext_ior": 1.0}
        # Its alpha is the roughness squared.
        base = {"type": "rgb", "value": [0.25] * 3}
        yield "schlick", [0.25], {"type": "principled", "metallic": 1.0, "roughness": alpha[0] ** 0.5, "base_color": base}


def direction(cosine, azimuth):
    sine = np.sqrt((1 - cosine) * (1 + cosine))
    return np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine]).astype(np.float32)


def interaction(view):
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(*[float(x) for x in view])
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    return si


def furnace(settings, alpha, view, seed, correlated, count=2_000_000):
    """The mean weight of a visible normal's light and its standard error."""
    distribution = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha[0], alpha[1], True)
    rng = mi.PCG32(size=count, initstate=seed)
    v = mi.Vector3f(*[float(x) for x in view])
    m, _ = distribution.sample(v, mi.Point2f(rng.next_float32(), rng.next_float32()))
    light = 2 * dr.dot(v, m) * m - v
    g_view, g_light = distribution.smith_g1(v, m), distribution.smith_g1(light, m)
    weight = 1 / (1 + g_view * (1 / g_light - 1)) if correlated else g_light
    weight = np.array(dr.select((light.z > 0) & (g_light > 0), weight, 0), dtype=float)
    if not correlated:
        numbers = mi.Point2f(rng.next_float32(), rng.next_float32())
        _, own = mi.load_dict(settings).sample(mi.BSDFContext(), interaction(view), 0.5, numbers)
        own = np.array(own[0], dtype=float)
        off = abs(own.mean() - weight.mean()) / np.hypot(own.std(), weight.std()) * np.sqrt(count)
        assert off < 5, f"the furnace of {alpha} at {view[2]} is {off} standard errors from the plugin's own"
    return weight.mean(), weight.std() / np.sqrt(count)


snapshot = Snapshot(__file__, oracle=["mitsuba", "drjit", "numpy"], precision="single; the furnace to its standard error", tolerance=1e-5)
u = iter(0.5 * (np.array(uniform(950, 4000)) + 1.0))
for alpha in ALPHAS:
    geometry = []
    for _ in range(6):
        view = direction(0.05 + 0.95 * next(u), 2 * np.pi * next(u))
        lights = []
        while len(lights) < 6:
            # Half vectors by their share of the distribution, tails included.
            share, turn = 0.98 * next(u), 2 * np.pi * next(u)
            slope = np.sqrt(share / (1 - share))
            half = np.array([alpha[0] * slope * np.cos(turn), alpha[1] * slope * np.sin(turn), 1.0])
            half /= np.linalg.norm(half)
            light = (2 * (half @ view) * half - view).astype(np.float32)
            if light[2] > 0.02:
                lights.append(light)
        geometry.append([view, lights])
    for kind, parameters, settings in plugins(alpha):
        bsdf, values, densities = mi.load_dict(settings), [], []
        for view, lights in geometry:
            value, density = bsdf.eval_pdf(mi.BSDFContext(), interaction(view), mi.Vector3f(np.array(lights).T))
            values.append(np.array(value[0]))
            densities.append(np.array(density))
        # The two others choose among lobes, and their densities tell of that.
        snapshot.case(
            "lobe", plugin=settings["type"], kind=kind, parameters=parameters, alpha=alpha, views=[g[0] for g in geometry],
            lights=[g[1] for g in geometry], values=values, densities=densities if settings["type"] == "roughconductor" else [],
        )  # fmt: skip

seed = 0
for alpha in ALPHAS:
    settings = next(iter(plugins(alpha)))[2]
    views = [direction(cosine, 0.8) for cosine in (1.0, 0.7, 0.3, 0.1)]
    means, errors = [], []
    for view in views:
        seed += 1
        furnace(settings, alpha, view, seed, correlated=False)
        mean, error = furnace(settings, alpha, view, seed, correlated=True)
        means.append(mean)
        errors.append(error)
    snapshot.case("furnace", tolerance=1e-3, alpha=alpha, views=views, means=means, errors=errors)
snapshot.write()
