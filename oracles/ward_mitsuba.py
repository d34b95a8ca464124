"""Ward's four lobes as a Mitsuba BSDF, in the half vector's angles as the papers print them.

The plugin first passes Mitsuba's own tests: χ² of its sampler against its density (each lobe, with a fault that has to be rejected),
the density's three routes against each other, and a white furnace against the lobe's integral over the hemisphere. Then its values and the furnace are written.

Needs a vectorised variant of Mitsuba, so LLVM 19 or newer: Debian's libllvm19, or DRJIT_LIBLLVM_PATH. Without it the script says so and the old
snapshot stays.
"""

import subprocess
import sys

import numpy as np
import scipy.stats
from snapshot import Snapshot, skip, uniform

PROBE = "import mitsuba, drjit; mitsuba.set_variant('llvm_ad_rgb'); print(drjit.sum(drjit.arange(mitsuba.Float, 4)))"
if subprocess.run([sys.executable, "-c", PROBE], capture_output=True).returncode != 0:
    skip("Mitsuba's llvm_ad_rgb does not run here: install libllvm19, or set DRJIT_LIBLLVM_PATH to a libLLVM.so of 19 or newer")

import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
from mitsuba.chi2 import ChiSquareTest, SphericalDomain  # noqa: E402

VARIANTS = ["ward1992", "duer", "gmd", "sampled"]


class Ward(mi.BSDF):
    """f·c_i at ρ_s = 1. `share` is that of the draws above the horizon, which `sampled` divides by; it holds for one view."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.variant = props["variant"]
        self.sigma_x, self.sigma_y = props["sigma_x"], props["sigma_y"]
        self.share = props.get("share", 1.0)
        flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
        if self.sigma_x != self.sigma_y:
            flags |= mi.BSDFFlags.Anisotropic
        self.m_components = [flags]
        self.m_flags = flags

    def half_vector(self, view, light):
        """E, cos δ and h·v."""
        half = dr.normalize(view + light)
        tan2 = dr.square(half.x / (half.z * self.sigma_x)) + dr.square(half.y / (half.z * self.sigma_y))
        return dr.exp(-tan2) / (4 * dr.pi * self.sigma_x * self.sigma_y), half.z, dr.dot(half, view)

    def value(self, view, light):
        gauss, cos_delta, h_dot_v = self.half_vector(view, light)
        return {
            "ward1992": lambda: gauss * dr.sqrt(light.z / view.z),
            "duer": lambda: gauss / view.z,
            "gmd": lambda: gauss * light.z / (h_dot_v**2 * cos_delta**4),
            "sampled": lambda: gauss / (h_dot_v * cos_delta**3) / self.share,
        }[self.variant]()

    def density(self, view, light):
        gauss, cos_delta, h_dot_v = self.half_vector(view, light)
        return gauss / (h_dot_v * cos_delta**3)

    def sample(self, ctx, si, sample1, sample2, active=True):
        view = si.wi
        tangent = dr.sqrt(-dr.log(1 - sample2.x))
        sine, cosine = dr.sincos(2 * dr.pi * sample2.y)
        half = dr.normalize(mi.Vector3f(self.sigma_x * tangent * cosine, self.sigma_y * tangent * sine, 1))
        h_dot_v = dr.dot(half, view)
        light = 2 * h_dot_v * half - view
        bs = mi.BSDFSample3f()
        bs.wo, bs.eta = light, 1.0
        bs.sampled_type, bs.sampled_component = mi.UInt32(+mi.BSDFFlags.GlossyReflection), mi.UInt32(0)
        active = mi.Bool(active) & (view.z > 0) & (light.z > 0)
        bs.pdf = dr.select(active, self.density(view, light), 0)
        # The weights as their papers print them, not value over density.
        weight = {
            "ward1992": lambda: h_dot_v * half.z**3 * dr.sqrt(light.z / view.z),
            "duer": lambda: h_dot_v * half.z**3 / view.z,
            "gmd": lambda: 2 * light.z / (light.z + view.z),
            "sampled": lambda: mi.Float(1 / self.share),
        }[self.variant]()
        return bs, mi.Color3f(dr.select(active, weight, 0))

    def eval(self, ctx, si, light, active=True):
        active = mi.Bool(active) & (si.wi.z > 0) & (light.z > 0)
        return mi.Color3f(dr.select(active, self.value(si.wi, light), 0))

    def pdf(self, ctx, si, light, active=True):
        active = mi.Bool(active) & (si.wi.z > 0) & (light.z > 0)
        return dr.select(active, self.density(si.wi, light), 0)

    def eval_pdf(self, ctx, si, light, active=True):
        return self.eval(ctx, si, light, active), self.pdf(ctx, si, light, active)

    def to_string(self):
        return f"Ward[{self.variant}, {self.sigma_x}, {self.sigma_y}]"


class WithoutDot(Ward):
    """A fault that χ² has to see: the density without 1/(h·v)."""

    def density(self, view, light):
        gauss, cos_delta, _ = self.half_vector(view, light)
        return gauss / cos_delta**3


mi.register_bsdf("ward", Ward)
mi.register_bsdf("ward_without_dot", WithoutDot)


def share_above(cosine, sigma):
    """1 − Q₁(√2 tan θ/σ, √2/(σ cos θ)): a non-central χ² of two degrees of freedom."""
    tan2 = (1 - cosine) * (1 + cosine) / cosine**2
    return scipy.stats.ncx2.cdf(2 / (sigma * cosine) ** 2, 2, 2 * tan2 / sigma**2)


def plugin(variant, sigma, cosine, kind="ward"):
    share = share_above(cosine, sigma[0]) if variant == "sampled" else 1.0
    return {"type": kind, "variant": variant, "sigma_x": sigma[0], "sigma_y": sigma[1], "share": share}


def direction(cosine, azimuth):
    sine = np.sqrt((1 - cosine) * (1 + cosine))
    return np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine]).astype(np.float32)


def interaction(view):
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(*[float(x) for x in view])
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    return si


def chi_square(settings, view, tests):
    sample, density = adapter(settings, view)
    # An even resolution puts the horizon, where the density ends abruptly, between two cells.
    test = ChiSquareTest(SphericalDomain(), sample, density, sample_dim=3, res=100, ires=16)
    return test.run(0.01, tests, quiet=True), test


def adapter(settings, view):
    """What `BSDFAdapter` is, for a dictionary in place of XML."""
    bsdf, context = mi.load_dict(settings), mi.BSDFContext()

    def sample(numbers):
        bs, weight = bsdf.sample(context, interaction(view), numbers[0], mi.Point2f(numbers[1], numbers[2]))
        return bs.wo, dr.select(weight[0] > 0, mi.Float(1), mi.Float(0))

    def density(light):
        return bsdf.pdf(context, interaction(view), light)

    return sample, density


def furnace(settings, view, seed, count=2_000_000):
    """The mean weight of a sample and its standard error: what an enclosure of radiance 1 shows."""
    bsdf = mi.load_dict(settings)
    rng = mi.PCG32(size=count, initstate=seed)
    bs, weight = bsdf.sample(mi.BSDFContext(), interaction(view), 0.5, mi.Point2f(rng.next_float32(), rng.next_float32()))
    weights = np.array(weight[0], dtype=float)
    return weights.mean(), weights.std() / np.sqrt(count)


def integral(settings, view, sigma):
    """∫ f c_i dω over the hemisphere by the midpoint rule in the half vector's slopes, dω = 4 (h·v) cos³δ dx dy."""
    bsdf = mi.load_dict(settings)
    edges = (np.arange(1500) + 0.5) / 1500 * 2 - 1
    x, y = (a.ravel() for a in np.meshgrid(6 * sigma[0] * edges, 6 * sigma[1] * edges))
    half = np.stack([x, y, np.ones_like(x)]) / np.sqrt(1 + x * x + y * y)
    dot = half.T @ view.astype(float)
    light = 2 * dot * half - view[:, None]
    keep = (light[2] > 0) & (dot > 0)
    values = np.array(bsdf.eval(mi.BSDFContext(), interaction(view), mi.Vector3f(light[:, keep].astype(np.float32)))[0], dtype=float)
    cell = (12 / 1500) ** 2 * sigma[0] * sigma[1]
    return (values * 4 * dot[keep] * half[2, keep] ** 3).sum() * cell


SIGMAS = [(0.01, 0.01), (0.05, 0.05), (0.2, 0.2), (0.5, 0.5), (0.1, 0.3)]
snapshot = Snapshot(
    __file__, oracle=["mitsuba", "drjit", "numpy", "scipy"], precision="single; the furnace to its standard error", tolerance=1e-5
)

# Mitsuba's own tests of the plugin.
cases = [(sigma, cosine) for sigma in ((0.1, 0.1), *SIGMAS[2:]) for cosine in (0.95, 0.6, 0.2)]
for sigma, cosine in cases:
    view = direction(cosine, 0.8)
    for variant in ("ward1992", "duer", "gmd"):
        passed, test = chi_square(plugin(variant, sigma, cosine), view, 3 * len(cases))
        assert passed, f"χ² rejects {variant} {sigma} {cosine}: {test.messages}"
    passed, _ = chi_square(plugin("duer", sigma, cosine, "ward_without_dot"), view, 1)
    assert not passed, f"χ² misses the fault at {sigma} {cosine}"
print(f"ward_mitsuba: χ² passed at {3 * len(cases)} places, and {len(cases)} faults were rejected")

u = iter(0.5 * (np.array(uniform(900, 4000)) + 1.0))
for sigma in SIGMAS:
    geometry, values, densities = [], {variant: [] for variant in VARIANTS}, []
    for _ in range(6):
        cosine = 0.05 + 0.95 * next(u)
        view = direction(cosine, 2 * np.pi * next(u))
        lights = []
        while len(lights) < 6:
            slope, turn = 2.5 * next(u), 2 * np.pi * next(u)
            half = np.array([sigma[0] * slope * np.cos(turn), sigma[1] * slope * np.sin(turn), 1.0])
            half /= np.linalg.norm(half)
            light = (2 * (half @ view) * half - view).astype(np.float32)
            if light[2] > 0.02:
                lights.append(light)
        geometry.append([view, lights])
        for variant in VARIANTS:
            if variant == "sampled" and sigma[0] != sigma[1]:
                continue
            bsdf = mi.load_dict(plugin(variant, sigma, float(view[2])))
            value, density = bsdf.eval_pdf(mi.BSDFContext(), interaction(view), mi.Vector3f(np.array(lights).T))
            assert np.array_equal(value[0], bsdf.eval(mi.BSDFContext(), interaction(view), mi.Vector3f(np.array(lights).T))[0])
            values[variant].append(np.array(value[0]))
        densities.append(np.array(density))
    for variant in VARIANTS:
        if values[variant]:
            snapshot.case(
                "lobe", variant=variant, sigma=sigma, views=[g[0] for g in geometry], lights=[g[1] for g in geometry], values=values[variant]
            )  # fmt: skip
    snapshot.case("pdf", sigma=sigma, views=[g[0] for g in geometry], lights=[g[1] for g in geometry], values=densities)

seed = 0
for sigma in SIGMAS:
    for variant in VARIANTS:
        if variant == "sampled" and sigma[0] != sigma[1]:
            continue
        means, errors, views = [], [], [direction(cosine, 0.8) for cosine in (1.0, 0.7, 0.3, 0.1)]
        for view in views:
            seed += 1
            settings = plugin(variant, sigma, float(view[2]))
            mean, error = furnace(settings, view, seed)
            exact = integral(settings, view, sigma)
            assert abs(mean - exact) < 5 * error + 3e-4, f"the furnace of {variant} {sigma} {view[2]}: {mean} ± {error}, the lobe's integral {exact}"
            means.append(mean)
            errors.append(error)
        snapshot.case("furnace", tolerance=1e-3, variant=variant, sigma=sigma, views=views, means=means, errors=errors)
snapshot.write()
