"""The real harmonics at directions, by two libraries with conventions of their own.

drjit: real, Cartesian argument, with the Condon-Shortley phase; its order 9 is the last that runs. Its double-precision scalar type.
scipy: complex, angles, with the phase.
"""

import warnings

import numpy as np
from convention import degrees_and_orders
from snapshot import Snapshot, uniform

import drjit
from drjit.scalar import Array3f64
from scipy.special import sph_harm_y

DRJIT_DEGREE = 9
SCIPY_DEGREE = 20
SCIPY_HIGH = 45  # of this degree, every order

# (θ, φ): inside, near either pole, on the equator, on both sides of the seam φ = ±π, the poles themselves.
u = uniform(1, 16)
angles = [(np.arccos(z), np.pi * p) for z, p in zip(u[::2], u[1::2])]
angles += [(1e-2, 0.3), (1e-5, 2.0), (1e-8, -1.0), (np.pi - 1e-5, 0.7), (np.pi / 2, 1.0), (np.pi / 2, -2.5)]
angles += [(1.0, 3.14), (1.0, -3.14), (0.0, 0.0), (np.pi, 0.0)]

snapshot = Snapshot(__file__, oracle=["drjit", "scipy"], precision="double", tolerance=1e-13)
for theta, phi in angles:
    direction = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])

    values = np.array(drjit.sh_eval(Array3f64(*direction), DRJIT_DEGREE)).ravel()
    l, m = degrees_and_orders(DRJIT_DEGREE)
    snapshot.case("drjit", direction=direction, degree=DRJIT_DEGREE, values=(-1.0) ** np.abs(m) * values)

    def real_harmonic(l, m):
        with warnings.catch_warnings(action="error"):
            complex_value = sph_harm_y(l, np.abs(m), theta, phi)
        part = np.where(m < 0, complex_value.imag, complex_value.real)
        return np.where(m == 0, 1.0, np.sqrt(2) * (-1.0) ** np.abs(m)) * part

    l, m = degrees_and_orders(SCIPY_DEGREE)
    snapshot.case("scipy", theta=theta, phi=phi, degree=SCIPY_DEGREE, values=real_harmonic(l, m))
    orders = np.arange(-SCIPY_HIGH, SCIPY_HIGH + 1)
    snapshot.case("scipy-high", theta=theta, phi=phi, degree=SCIPY_HIGH, values=real_harmonic(SCIPY_HIGH, orders))
snapshot.write()
