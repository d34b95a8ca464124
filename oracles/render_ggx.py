"""Spheres of GGX facets under captured light by Mitsuba, with the Monte Carlo error of each pixel.

Light and sphere are those of `render_tools`; the facets are Mitsuba's: its distribution of normals, its masking of one direction, its Fresnel
equations. Mitsuba masks and shadows each by itself, G1(v) G1(i), where the crate's lobe has the two correlated by height, so that the BSDF here takes
1/(1/G1(v) + 1/G1(i) - 1). Each pixel is the mean over its area of 32 pictures of 1024 samples, and its error is theirs over √32; only pixels that
lie well inside the sphere are kept. Where there is no LLVM for Mitsuba (libllvm19 in Debian) the script is skipped.
"""

import sys

import numpy as np
from snapshot import Snapshot, skip

if "--help" not in sys.argv:
    import drjit as dr
    import mitsuba as mi
    import render_tools

    if render_tools.VARIANT == "scalar_rgb":
        skip("Mitsuba finds no LLVM 16 or newer; name one in DRJIT_LIBLLVM_PATH")

SIZE, PICTURES, SAMPLES = 16, 32, 1024
#: What the facets are of, as the crate's files say it; a body under them where they are of no metal. The tangents of Mitsuba's sphere lie along the
#: circles about +z.
MATERIALS = [
    {"diffuse": [0.3, 0.15, 0.05], "alpha": [0.2, 0.2], "index": [1.5, 1.5, 1.5]},
    {"diffuse": [0.0, 0.0, 0.0], "alpha": [0.1, 0.1], "index": [0.2, 0.4, 1.5], "extinction": [3.1, 2.7, 1.9]},
    {"diffuse": [0.1, 0.1, 0.1], "alpha": [0.5, 0.5], "f0": [0.5, 0.4, 0.3]},
    {"diffuse": [0.0, 0.0, 0.0], "alpha": [0.1, 0.4], "f0": [0.9, 0.8, 0.7]},
    {"diffuse": [0.05, 0.1, 0.2], "alpha": [0.5, 0.1], "index": [1.5, 1.5, 1.5]},
]


def bsdf():
    class Ggx(mi.BSDF):
        """rho_d / pi + F D G / (4 c_v c_i)."""

        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.alpha = [float(props[f"alpha_{axis}"]) for axis in "xy"]
            self.kind = props["kind"]
            color = lambda name: [float(props[f"{name}_{c}"]) for c in "rgb"]
            self.diffuse, self.first, self.second = color("diffuse"), color("first"), color("second")
            self.share = 0.5 if sum(self.diffuse) else 1.0
            flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
            self.m_components, self.m_flags = [flags], flags

        def distribution(self):
            return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, *self.alpha, True)

        def fresnel(self, cosine):
            if self.kind == "schlick":
                return mi.Color3f(*[f + (1 - f) * (1 - cosine) ** 5 for f in self.first])
            if self.kind == "dielectric":
                return mi.Color3f(*[mi.fresnel(cosine, n)[0] for n in self.first])
            return mi.Color3f(*[mi.fresnel_conductor(cosine, mi.Complex2f(n, k)) for n, k in zip(self.first, self.second)])

        def sample(self, ctx, si, sample1, sample2, active):
            facet, _ = self.distribution().sample(si.wi, sample2)
            shiny = 2 * dr.dot(si.wi, facet) * facet - si.wi
            dull = mi.warp.square_to_cosine_hemisphere(sample2)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = dr.select(sample1 < self.share, shiny, dull)
            bs.pdf = self.pdf(ctx, si, bs.wo, active)
            bs.eta = 1.0
            bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
            bs.sampled_component = 0
            good = active & (bs.pdf > 0)
            return bs, dr.select(good, self.eval(ctx, si, bs.wo, active) / dr.maximum(bs.pdf, 1e-30), 0)

        def eval(self, ctx, si, wo, active):
            good = active & (si.wi.z > 0) & (wo.z > 0)
            h, facets = dr.normalize(si.wi + wo), self.distribution()
            view, light = facets.smith_g1(si.wi, h), facets.smith_g1(wo, h)
            masking = 1 / (1 / view + 1 / light - 1)
            lobe = self.fresnel(dr.dot(h, si.wi)) * (facets.eval(h) * masking / (4 * si.wi.z))
            return dr.select(good, mi.Color3f(self.diffuse) * (wo.z / np.pi) + lobe, 0)

        def pdf(self, ctx, si, wo, active):
            good = active & (si.wi.z > 0) & (wo.z > 0)
            h = dr.normalize(si.wi + wo)
            density = self.distribution().pdf(si.wi, h) / (4 * dr.dot(h, wo))
            return dr.select(good, self.share * density + (1 - self.share) * wo.z / np.pi, 0)

        def eval_pdf(self, ctx, si, wo, active):
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

        def to_string(self):
            return "Ggx"

    mi.register_bsdf("lobes_ggx", lambda props: Ggx(props))


def settings(material):
    first = material.get("f0", material.get("index"))
    second = material.get("extinction", [0.0] * 3)
    kind = "schlick" if "f0" in material else "conductor" if "extinction" in material else "dielectric"
    settings = {"type": "lobes_ggx", "kind": kind} | dict(zip(("alpha_x", "alpha_y"), material["alpha"]))
    for values, name in ((material["diffuse"], "diffuse"), (first, "first"), (second, "second")):
        settings.update({f"{name}_{c}": value for c, value in zip("rgb", values)})
    return settings


snapshot = Snapshot(__file__, oracle=["mitsuba", "drjit"], precision="single; Monte Carlo, 32768 samples a pixel", tolerance=0.05)
bsdf()
kept = render_tools.well_inside(SIZE)
for light in ("pmndrs-venice", "blender-forest"):
    emitter = render_tools.emitter(render_tools.read_map(light))
    for material in MATERIALS:
        scene = render_tools.sphere(emitter, settings(material), SIZE)
        mean, error = render_tools.estimate(scene, SAMPLES, PICTURES)
        snapshot.case(
            "sphere", light=light, **material, axis=[0, 0, 1], size=SIZE, pictures=PICTURES, pixels=kept,
            values=[[float(f"{v:.6g}") for v in mean[p]] for p in kept], errors=[[float(f"{v:.3g}") for v in error[p]] for p in kept],
        )  # fmt: skip
snapshot.write()
