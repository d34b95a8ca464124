"""HEALPix in the order of rings by healpy: pixel centres, synthesis, and analysis with iterations.

Coefficients and maps that go in are made from a seed (`uniform`), coefficients in the order l² + l + m.
"""

import numpy as np
from convention import to_complex, to_real
from snapshot import Snapshot, uniform

import healpy

snapshot = Snapshot(__file__, oracle=["healpy"], precision="double", tolerance=1e-12)
for nside in (1, 2, 3, 8):
    snapshot.case("pixels", nside=nside, vectors=np.stack(healpy.pix2vec(nside, np.arange(12 * nside**2)), -1).ravel())
# Degrees past the half of every ring, and past all of the short ones.
for seed, (nside, degree) in enumerate([(1, 2), (3, 6), (4, 11), (5, 14), (8, 30)], start=800):
    alm = to_complex(uniform(seed, (degree + 1) ** 2), degree)
    snapshot.case("synthesis", nside=nside, degree=degree, seed=seed, map=healpy.alm2map(alm, nside, lmax=degree, pol=False))
nside, degree, seed = 64, 160, 810
field = healpy.alm2map(to_complex(uniform(seed, (degree + 1) ** 2), degree), nside, lmax=degree, pol=False)
shown = sorted({*range(0, 300, 7), *range(5000, 12 * nside**2, 997), 12 * nside**2 - 1})
snapshot.case("synthesis-high", nside=nside, degree=degree, seed=seed, shown=shown, values=field[shown])
for seed, (nside, degree, iterations) in enumerate([(4, 8, 0), (4, 11, 3), (5, 10, 3)], start=820):
    noise = np.array(uniform(seed, 12 * nside**2))
    alm = healpy.map2alm(noise, lmax=degree, iter=iterations, pol=False)
    snapshot.case("analysis", nside=nside, degree=degree, seed=seed, iterations=iterations, coefficients=to_real(alm, degree))
snapshot.write()
