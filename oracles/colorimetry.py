"""Luminance, sRGB and the ColorChecker by colour-science."""

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

# The transfer function of sRGB: every 8-bit code decoded, and 16-bit codes at random.
codes = np.arange(256)
snapshot.case("srgb-decode", codes=codes, depth=8, linear=colour.models.eotf_sRGB(codes / 255))
codes = np.unique((np.array(uniform(7, 300)) * 0.5 + 0.5) * 65535 // 1).astype(int)
snapshot.case("srgb-decode", codes=codes, depth=16, linear=colour.models.eotf_sRGB(codes / 65535))

# Linear sRGB of the ColorChecker's patches under their own white, adapted to D65: albedos of real paints.
checker = colour.CCS_COLOURCHECKERS["ColorChecker24 - After November 2014"]
linear = colour.XYZ_to_RGB(
    colour.xyY_to_XYZ(np.array(list(checker.data.values()))), "sRGB", checker.illuminant, chromatic_adaptation_transform="Bradford"
)
snapshot.case("colorchecker", patches=list(checker.data), albedos=linear)
snapshot.write()
