"""Synthesis, analysis and spectra by ducc0 and healpy.

Coefficients and maps that go in are made from a seed (`uniform`), coefficients in the order l² + l + m.
"""

import numpy as np
from convention import to_complex, to_real
from snapshot import Snapshot, uniform

import ducc0
import healpy

# name here: (name of ducc0, azimuth of the first column in columns)
GRIDS = {"gauss-legendre": ("GL", 0.0), "clenshaw-curtis": ("CC", 0.0), "fejer": ("F1", 0.5)}


def geometry(grid, rings, columns):
    name, offset = GRIDS[grid]
    theta = ducc0.misc.GL_thetas(rings) if name == "GL" else np.pi * (np.arange(rings) + offset) / (rings - 1 + 2 * offset)
    weights = ducc0.misc.GL_weights(rings, columns) if name == "GL" else ducc0.sht.get_gridweights(name, rings) / columns
    return {
        "theta": theta,
        "nphi": np.full(rings, columns, dtype=np.uint64),
        "phi0": np.full(rings, 2 * np.pi * offset / columns),
        "ringstart": np.arange(rings, dtype=np.uint64) * np.uint64(columns),
    }, np.repeat(weights, columns)


def synthesis(grid, rings, columns, degree, seed):
    alm = to_complex(uniform(seed, (degree + 1) ** 2), degree)
    rings_of, _ = geometry(grid, rings, columns)
    return ducc0.sht.synthesis(alm=alm[None], lmax=degree, spin=0, nthreads=1, **rings_of)[0]


def analysis(grid, rings, columns, degree, seed):
    values = np.array(uniform(seed, rings * columns))
    rings_of, weights = geometry(grid, rings, columns)
    assert abs(weights.sum() - 4 * np.pi) < 1e-12
    alm = ducc0.sht.adjoint_synthesis(map=(weights * values)[None], lmax=degree, spin=0, nthreads=1, **rings_of)[0]
    return to_real(alm, degree)


snapshot = Snapshot(__file__, oracle=["ducc0", "healpy"], precision="double", tolerance=1e-12)
for seed, (grid, rings, columns, degree) in enumerate(
    [("gauss-legendre", 17, 36, 16), ("clenshaw-curtis", 35, 35, 17), ("fejer", 34, 64, 16), ("fejer", 37, 41, 18)], start=100
):
    shape = {"grid": grid, "rings": rings, "columns": columns, "degree": degree, "seed": seed}
    snapshot.case("synthesis", **shape, map=synthesis(grid, rings, columns, degree, seed))
    # A map of noise holds every degree, so the quadrature itself is compared and not only its exactness.
    snapshot.case("analysis", **shape, coefficients=analysis(grid, rings, columns, degree, seed))

# The last degree that equiangular rings carry: twice what weights on them serve. ducc0 finds its coefficients again as well.
for seed, (grid, rings, columns, degree) in enumerate(
    [("fejer", 20, 41, 19), ("fejer", 21, 44, 20), ("clenshaw-curtis", 20, 37, 18), ("clenshaw-curtis", 21, 40, 19)], start=150
):
    alm = to_complex(uniform(seed, (degree + 1) ** 2), degree)[None]
    options = {"lmax": degree, "spin": 0, "geometry": GRIDS[grid][0]}
    again = ducc0.sht.analysis_2d(map=ducc0.sht.synthesis_2d(alm=alm, ntheta=rings, nphi=columns, **options), **options)
    assert np.abs(again - alm).max() < 1e-13
    field = synthesis(grid, rings, columns, degree, seed)
    snapshot.case("analysis-full", grid=grid, rings=rings, columns=columns, degree=degree, seed=seed, map=field)

for seed, (grid, rings, columns, degree) in enumerate([("gauss-legendre", 256, 512, 255), ("fejer", 512, 512, 255)], start=200):
    field = synthesis(grid, rings, columns, degree, seed).reshape(rings, columns)
    shown = [0, 1, rings // 4, rings // 2, rings - 1]
    snapshot.case(
        "synthesis-high", grid=grid, rings=rings, columns=columns, degree=degree, seed=seed,
        shown=shown, map=field[shown, ::4],
    )  # fmt: skip

DEGREE = 48
a, b = (to_complex(uniform(seed, (DEGREE + 1) ** 2), DEGREE) for seed in (300, 301))
snapshot.case(
    "spectrum", degree=DEGREE, seeds=[300, 301], auto=healpy.alm2cl(a), cross=healpy.alm2cl(a, b)
)
snapshot.write()
