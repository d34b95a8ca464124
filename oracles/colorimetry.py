"""Luminance, sRGB, chromatic adaptation, and the albedos of known paints, by colour-science."""

import warnings

import numpy as np
from snapshot import Snapshot, uniform

with warnings.catch_warnings(action="ignore"):  # of drawing packages that are not there
    import colour

snapshot = Snapshot(__file__, oracle=["colour-science"], precision="double", tolerance=1e-14)

# Luminance rows: BT.709's own four digits, the row that its primaries and D65 give, and Radiance's primaries (color.h) with its white.
red, blue = colour.WEIGHTS_YCBCR["ITU-R BT.709"]
bt709 = colour.RGB_COLOURSPACES["ITU-R BT.709"]
radiance_primaries = np.array([[0.640, 0.330], [0.290, 0.600], [0.150, 0.060]])
radiance = colour.normalised_primary_matrix(radiance_primaries, np.array([0.3333, 0.3333]))
snapshot.case("luminance", weights="rec709", row=[red, 1 - red - blue, blue])
snapshot.case("luminance-of-primaries", weights="rec709", row=colour.normalised_primary_matrix(bt709.primaries, bt709.whitepoint)[1])
snapshot.case("luminance", weights="radiance", row=radiance[1])

# The transfer function of sRGB: every 8-bit code decoded, 16-bit codes at random, and linear values encoded: at random, and about the knee.
codes = np.arange(256)
snapshot.case("srgb-decode", codes=codes, depth=8, linear=colour.models.eotf_sRGB(codes / 255))
codes = np.unique((np.array(uniform(7, 300)) * 0.5 + 0.5) * 65535 // 1).astype(int)
snapshot.case("srgb-decode", codes=codes, depth=16, linear=colour.models.eotf_sRGB(codes / 65535))

linear = np.concatenate([np.array(uniform(8, 200)) * 0.5 + 0.5, (np.array(uniform(9, 60)) * 0.5 + 0.5) * 0.0062, [0, 0.0031308, 1]])
snapshot.case("srgb-encode", linear=linear, encoded=colour.models.eotf_inverse_sRGB(linear))

# Colours seen under one white and adapted to another, in BT.709's primaries with D65: Bradford's cones, each white of luminance 1.
to_xyz = colour.normalised_primary_matrix(bt709.primaries, bt709.whitepoint)
triples = np.array(uniform(11, 3 * 40)).reshape(-1, 3) * 0.5 + 0.5
whites, colours = 0.2 + 0.8 * triples[:8], triples[8:]
for source, target in zip(whites[:4], [np.ones(3), *whites[4:7]]):
    xyz = [to_xyz @ white / (to_xyz @ white)[1] for white in (source, target)]
    matrix = colour.adaptation.matrix_chromatic_adaptation_VonKries(*xyz, transform="Bradford")
    adapted = [np.linalg.solve(to_xyz, matrix @ to_xyz @ rgb) for rgb in colours]
    snapshot.case("adaptation", source=source, target=target, colours=colours, adapted=adapted)

# Linear sRGB of real paints, adapted from the white that they are given under to D65: the ColorChecker's patches, and every
# 90th of Munsell's real colours. What sRGB cannot show is left out.


def albedos(name, names, chromaticities, white):
    linear = colour.XYZ_to_RGB(colour.xyY_to_XYZ(np.array(chromaticities)), "sRGB", white, chromatic_adaptation_transform="Bradford")
    inside = np.all((linear >= 0) & (linear <= 1), axis=1)
    snapshot.case(name, patches=[patch for patch, keep in zip(names, inside) if keep], albedos=linear[inside])


checker = colour.CCS_COLOURCHECKERS["ColorChecker24 - After November 2014"]
albedos("colorchecker", list(checker.data), list(checker.data.values()), checker.illuminant)
munsell = colour.MUNSELL_COLOURS["real"][::90]
illuminant = colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["C"]
# The renotation's Y goes to 102.57, magnesium oxide being its white.
albedos("munsell", [f"{h} {v:g}/{c:g}" for (h, v, c), _ in munsell], [[x, y, Y / 102.57] for _, (x, y, Y) in munsell], illuminant)
snapshot.write()
