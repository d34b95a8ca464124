"""The spectrum of light: a map's coefficients by ducc0, the power law by SciPy.

The map of `oracles/map.py` in shape: row 0 the zenith (+y), the centre column along -z, +x to its right. The harmonic frame has its pole on +y,
its azimuth 0 on +z, and turns from there to +x; so a column's azimuth there falls from 2π to 0.
"""

import numpy as np
from convention import to_real
from scipy.stats import linregress
from snapshot import Snapshot, uniform

import ducc0

HEIGHT, WIDTH, SEED, DEGREE = 20, 40, 610, 9

pixels = np.array(uniform(SEED, 3 * HEIGHT * WIDTH)).reshape(HEIGHT * WIDTH, 3) + 1
theta = np.pi * (np.arange(HEIGHT) + 0.5) / HEIGHT
column = np.arange(WIDTH)
centre = 2 * np.pi * (column + 0.5) / WIDTH - np.pi  # from -z towards +x
azimuth = np.arctan2(np.sin(centre), -np.cos(centre))  # of the world's (x, z) = (sin, -cos) as (x over z)
assert np.allclose(np.exp(1j * azimuth), np.exp(-2j * np.pi * (column + 0.5) / WIDTH))

# Each pixel is a ring of one point for ducc0.
where = {
    "theta": theta.repeat(WIDTH),
    "phi0": np.tile(azimuth, HEIGHT),
    "nphi": np.ones(HEIGHT * WIDTH, dtype=np.uint64),
    "ringstart": np.arange(HEIGHT * WIDTH, dtype=np.uint64),
}
weights = (ducc0.sht.get_gridweights("F1", HEIGHT) / WIDTH).repeat(WIDTH)
alm = [ducc0.sht.adjoint_synthesis(map=(weights * pixels[:, c])[None], lmax=DEGREE, spin=0, nthreads=1, **where)[0] for c in range(3)]

snapshot = Snapshot(__file__, oracle=["ducc0", "scipy", "numpy"], precision="double", tolerance=1e-12)
snapshot.case(
    "coefficients", height=HEIGHT, width=WIDTH, seed=SEED, degree=DEGREE, coefficients=[to_real(a, DEGREE) for a in alm]
)

for seed, eta, scatter, first, last in ((620, 0.3, 0.5, 2, 64), (621, 0.65, 0.1, 1, 40), (622, -0.5, 0.9, 5, 127), (623, 0.0, 0.3, 3, 5)):
    l = np.arange(1, last + 4)
    power = np.append(1.0, 7.0 * l ** (-2 - eta) * (1 + scatter * np.array(uniform(seed, len(l)))))
    fit = linregress(np.log(l[first - 1 : last]), np.log(power[first : last + 1]))
    snapshot.case(
        "power-law", power=power, first=first, last=last,
        k=np.exp(fit.intercept), eta=-fit.slope - 2, eta_error=fit.stderr, ln_k_error=fit.intercept_stderr,
    )  # fmt: skip
snapshot.write()
