"""Fields of SHTns, by the coefficients as it stores them: complex, m ≥ 0 by order, l contiguous, in its three normalisations with and without
the Condon-Shortley phase; what its synthesis makes of them on a Gauss-Legendre grid.

SHTns builds against FFTW, so it is not among the pinned oracles: where it is missing this is skipped.
"""

import numpy as np
from snapshot import Snapshot, skip, uniform

try:
    import shtns
except ImportError:
    skip("SHTns is not there: install Debian's libfftw3-dev, then shtns==3.7.5 into the oracles' environment by pip")

DEGREE = 7
NORMS = {"ortho": shtns.sht_orthonormal, "4pi": shtns.sht_fourpi, "schmidt": shtns.sht_schmidt}

snapshot = Snapshot(__file__, oracle=["shtns"], precision="double", tolerance=1e-13)
for seed, (name, norm) in enumerate(NORMS.items()):
    for condon_shortley in (True, False):
        sht = shtns.sht(DEGREE, norm=norm | (0 if condon_shortley else shtns.SHT_NO_CS_PHASE), nthreads=1)
        rings, columns = sht.set_grid(32, 20, flags=shtns.sht_gauss | shtns.SHT_PHI_CONTIGUOUS)
        re, im = np.array(uniform(seed + 1, 2 * sht.nlm)).reshape(2, -1)
        alm = re + 1j * np.where(sht.m == 0, 0.0, im)
        values = sht.synth(alm)
        shown = np.arange(0, rings * columns, 53)
        ring, column = shown // columns, shown % columns
        z, phi = sht.cos_theta[ring], 2 * np.pi * column / columns
        s = np.sqrt(1 - z * z)
        snapshot.case(
            "shtns", normalisation=name, condon_shortley=condon_shortley, degree=DEGREE,
            coefficients=np.stack([alm.real, alm.imag], axis=-1),
            directions=np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=-1), values=values[ring, column],
        )  # fmt: skip
snapshot.write()
