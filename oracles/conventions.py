"""One field of each library's own: its coefficients as it stores them, and what it makes of them at directions.

scipy: complex, Condon-Shortley phase, sph_harm_y(l, m, θ, φ); a_l,-m is (-1)^m times the conjugate of a_lm; written for m ≥ 0 by order.
healpy, ducc0: complex, the same phase, m ≥ 0 by order, l contiguous.
shtools: real, cosine and sine arrays, six conventions; written in the order l² + l + m, the sines at -m.
drjit: real, Condon-Shortley phase, in the order l² + l + m. sphericart: the same without the phase.
"""

import numpy as np
from convention import degrees_and_orders
from snapshot import Snapshot, uniform

import drjit
import ducc0
import healpy
import pyshtools
import sphericart
from drjit.scalar import Array3f64
from scipy.special import sph_harm_y

DEGREE = 7

z, turn = np.array(uniform(1, 24)).reshape(2, 12)
theta, phi = np.arccos(z), np.pi * turn
directions = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
l, m = degrees_and_orders(DEGREE)
real = np.array(uniform(2, (DEGREE + 1) ** 2))


def complex_set(seed):
    """l, m and a_lm for m ≥ 0 by order; those of order 0 are real."""
    m, l = np.array([(m, l) for m in range(DEGREE + 1) for l in range(m, DEGREE + 1)]).T
    re, im = np.array(uniform(seed, 2 * m.size)).reshape(2, -1)
    return l, m, re + 1j * np.where(m == 0, 0.0, im)


def pairs(alm):
    return np.stack([alm.real, alm.imag], axis=-1)


snapshot = Snapshot(
    __file__, oracle=["scipy", "healpy", "ducc0", "pyshtools", "drjit", "sphericart"], precision="double", tolerance=1e-13
)  # fmt: skip

ls, ms, alm = complex_set(10)
positive = alm @ sph_harm_y(ls[:, None], ms[:, None], theta, phi)
others = ((-1.0) ** ms * alm.conj())[ms > 0] @ sph_harm_y(ls[ms > 0, None], -ms[ms > 0, None], theta, phi)
field = positive + others
assert np.abs(field.imag).max() < 1e-13
snapshot.case("scipy", degree=DEGREE, coefficients=pairs(alm), directions=directions, values=field.real)

_, _, alm = complex_set(11)
pixels = healpy.alm2map(alm, 4, pol=False)
shown = np.arange(0, pixels.size, 13)
snapshot.case("healpy", degree=DEGREE, coefficients=pairs(alm), directions=np.stack(healpy.pix2vec(4, shown), axis=-1), values=pixels[shown])

_, _, alm = complex_set(12)
points = np.stack([theta, phi % (2 * np.pi)], axis=-1)
values = ducc0.sht.synthesis_general(alm=alm[None], lmax=DEGREE, spin=0, loc=points, epsilon=1e-14, nthreads=1)[0]
snapshot.case("ducc0", degree=DEGREE, coefficients=pairs(alm), directions=directions, values=values, tolerance=1e-12)

for normalization in ("4pi", "ortho", "schmidt"):
    for phase in (1, -1):
        cilm = np.zeros((2, DEGREE + 1, DEGREE + 1))
        cilm[np.where(m < 0, 1, 0), l, np.abs(m)] = real
        coefficients = pyshtools.SHCoeffs.from_array(cilm, normalization=normalization, csphase=phase)
        values = coefficients.expand(lat=90 - np.degrees(theta), lon=np.degrees(phi))
        snapshot.case(
            "shtools", normalisation=normalization, condon_shortley=phase == -1, degree=DEGREE,
            coefficients=real, directions=directions, values=values,
        )  # fmt: skip

basis = np.stack([np.array(drjit.sh_eval(Array3f64(*d), DEGREE)).ravel() for d in directions])
snapshot.case("drjit", degree=DEGREE, coefficients=real, directions=directions, values=basis @ real)
basis = sphericart.SphericalHarmonics(DEGREE).compute(directions)
snapshot.case("sphericart", degree=DEGREE, coefficients=real, directions=directions, values=basis @ real)
snapshot.write()
