"""What a latitude-longitude map says between its pixels, by SciPy's interpolator.

Row 0 is the zenith (+y), the centre column looks along -z with +x to its right, values stand at the pixels' centres, and between them the map is
bilinear in the angles. Beyond a pole the map goes on half a turn round, beyond the seam it goes on.
The map's pixels are made from a seed: u + 1 of `uniform`, row by row, red, green and blue in turn.
"""

import numpy as np
from scipy.integrate import dblquad
from scipy.interpolate import RegularGridInterpolator
from snapshot import Snapshot, uniform

HEIGHT, WIDTH, SEED = 6, 12, 600

pixels = np.array(uniform(SEED, 3 * HEIGHT * WIDTH)).reshape(HEIGHT, WIDTH, 3) + 1
beyond_a_pole = np.roll(pixels, WIDTH // 2, axis=1)
padded = np.concatenate([beyond_a_pole[:1], pixels, beyond_a_pole[-1:]])
padded = np.concatenate([padded[:, -1:], padded, padded[:, :1]], axis=1)
theta = np.pi * (np.arange(-1, HEIGHT + 1) + 0.5) / HEIGHT
longitude = 2 * np.pi * (np.arange(-1, WIDTH + 1) + 0.5) / WIDTH - np.pi  # from -z towards +x
radiance = RegularGridInterpolator((theta, longitude), padded)

snapshot = Snapshot(__file__, oracle=["scipy", "numpy"], precision="double; means to 1e-13", tolerance=1e-13)
shape = {"height": HEIGHT, "width": WIDTH, "seed": SEED}

directions = np.array(uniform(601, 3 * 60)).reshape(60, 3)
corners = [[0, 1, 0], [0, -1, 0], [1e-9, 1, 0], [0, 1, -1e-3], [1, 0, 0], [-1, 0, 0], [0, 0, -1], [0, 0, 1], [1e-9, 0.2, 1], [-1e-9, 0.2, 1]]
directions = np.concatenate([directions, corners])
directions /= np.linalg.norm(directions, axis=1)[:, None]
x, y, z = directions.T
at = np.stack([np.arctan2(np.hypot(x, z), y), np.arctan2(x, -z)], axis=-1)
snapshot.case("radiance", **shape, directions=directions, values=radiance(at))

rows, columns = np.arange(HEIGHT).repeat(WIDTH), np.tile(np.arange(WIDTH), HEIGHT)
a, b = theta[1:-1][rows], longitude[1:-1][columns]
centres = np.stack([np.sin(a) * np.sin(b), np.cos(a), -np.sin(a) * np.cos(b)], axis=-1)
snapshot.case("centres", **shape, directions=centres, values=pixels.reshape(-1, 3))

# The mean over the sphere, cell by cell of the interpolant.
breaks = np.concatenate([[0], theta[1:-1], [np.pi]])
round_the_axis = RegularGridInterpolator((theta,), padded[:, 1:-1].mean(axis=1))
nodes, weights = np.polynomial.legendre.leggauss(20)
mean = np.zeros(3)
for low, high in zip(breaks[:-1], breaks[1:]):
    middle, half = (low + high) / 2, (high - low) / 2
    points = middle + half * nodes
    mean += (round_the_axis(points[:, None]) * (half * weights * np.sin(points) / 2)[:, None]).sum(axis=0)
check = dblquad(lambda p, t: radiance([t, p])[0, 0] * np.sin(t) / (4 * np.pi), *breaks[1:3], -np.pi, np.pi, epsabs=1e-4, epsrel=1e-4)[0]
middle, half = (breaks[1] + breaks[2]) / 2, (breaks[2] - breaks[1]) / 2
points = middle + half * nodes
assert abs(check - (round_the_axis(points[:, None])[:, 0] * half * weights * np.sin(points) / 2).sum()) < 1e-4
snapshot.case("mean", **shape, mean=mean)
snapshot.write()
