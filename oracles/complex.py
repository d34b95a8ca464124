"""Complex fields on a grid, by SciPy's complex harmonics one after another.

Coefficients a_lm are made from seeds (`uniform`), real parts from the first and imaginary parts from the second, at l² + l + m.
"""

import numpy as np
from scipy.special import sph_harm_y
from snapshot import Snapshot, uniform

DEGREE, RINGS, COLUMNS = 12, 14, 27

snapshot = Snapshot(__file__, oracle=["scipy", "numpy"], precision="double", tolerance=1e-12)
nodes = np.polynomial.legendre.leggauss(RINGS)[0][::-1]
theta, phi = np.arccos(nodes)[:, None], 2 * np.pi * np.arange(COLUMNS) / COLUMNS
for seeds in ((700, 701), (702, 703)):
    real, imaginary = (np.array(uniform(seed, (DEGREE + 1) ** 2)) for seed in seeds)
    field = np.zeros((RINGS, COLUMNS), dtype=complex)
    for l in range(DEGREE + 1):
        for m in range(-l, l + 1):
            at = l * l + l + m
            field += (real[at] + 1j * imaginary[at]) * sph_harm_y(l, m, theta, phi)
    snapshot.case("synthesis", degree=DEGREE, rings=RINGS, columns=COLUMNS, seeds=seeds, real=field.real.ravel(), imaginary=field.imag.ravel())
snapshot.write()
