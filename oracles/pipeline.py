"""The paper's features, from the pixels of a picture of a sphere to v1 … v7 and colour, in numpy with ducc0.

The pictures are made here and in the contract from a few bumps over the sphere of normals, w exp(κ (n·d − 1)) for each channel, so that
only the bumps need be written down. Pixel (row, column) of an orthographic picture of size² shows the normal (x, y, √(1 − x² − y²)),
x = (2 column + 1)/size − 1 to the right and y = 1 − (2 row + 1)/size up, where x² + y² < 1.

The field over the normals is the picture read bilinearly at (x, y) among the neighbours that show the sphere, their weights made to sum
to one; where none does, (x, y) is drawn towards the centre by the factor 1 − 2/size until one does. The grid is Gauss–Legendre of four rings
and four columns a degree with its pole towards the camera.
"""

import numpy as np
from convention import degrees_and_orders, to_real
from snapshot import Snapshot, uniform

import ducc0

DEGREE = 64
REC709 = np.array([0.2126, 0.7152, 0.0722])
SIZE = 48


def bumps(seed, count, sharpness):
    """[direction, sharpness, weight of each channel] of each bump; the first is broad, so that no pixel is black."""
    rows = []
    for i, u in enumerate(np.array(uniform(seed, 6 * count)).reshape(count, 6)):
        direction = np.append(0.9 * u[:2], 1.0)
        direction /= np.linalg.norm(direction)
        rows.append([*direction, 0.5 if i == 0 else sharpness * (1.5 + u[2]), *(1.0 + 0.9 * u[3:])])
    return np.array(rows)


def picture(rows):
    centres = (2 * np.arange(SIZE) + 1) / SIZE - 1
    x, y = np.meshgrid(centres, -centres)
    inside = x**2 + y**2 < 1
    normals = np.stack([x, y, np.sqrt(np.where(inside, 1 - x**2 - y**2, 0))], axis=-1)
    rise = np.exp(rows[:, 3] * (normals @ rows[:, :3].T - 1))
    return np.where(inside[..., None], rise @ rows[:, 4:], np.nan)


def read(image, x, y):
    """The picture at (x, y), or None where no neighbour shows the sphere."""
    column, row = (x + 1) * SIZE / 2 - 0.5, (1 - y) * SIZE / 2 - 0.5
    c, r = int(np.floor(column)), int(np.floor(row))
    total, weights = np.zeros(3), 0.0
    for rr in (r, r + 1):
        for cc in (c, c + 1):
            weight = (1 - abs(row - rr)) * (1 - abs(column - cc))
            if 0 <= rr < SIZE and 0 <= cc < SIZE and np.isfinite(image[rr, cc, 0]):
                total, weights = total + weight * image[rr, cc], weights + weight
    return total / weights if weights > 1e-9 else None


def front(image, rings, columns):
    theta = ducc0.misc.GL_thetas(rings)[: rings // 2]
    phi = 2 * np.pi * np.arange(columns) / columns
    field = np.empty((rings // 2, columns, 3))
    for i in range(rings // 2):
        for j in range(columns):
            x, y = np.sin(theta[i]) * np.cos(phi[j]), np.sin(theta[i]) * np.sin(phi[j])
            value = read(image, x, y)
            while value is None:
                x, y = x * (1 - 2 / SIZE), y * (1 - 2 / SIZE)
                value = read(image, x, y)
            field[i, j] = value
    return field


def continued(field, continuation):
    """The field behind is that of the front at (x, y, −z) mirrored, at (−x, y, −z) half a turn about the vertical, or zero."""
    back = field[::-1]
    if continuation == "half-turn":
        columns = field.shape[1]
        back = back[:, (columns // 2 - np.arange(columns)) % columns]
    elif continuation == "zero":
        back = np.zeros_like(back)
    return np.concatenate([field, back])


def power(field):
    """B_l of the luminance, and B_0 of each channel."""
    rings, columns, _ = field.shape
    weights = ducc0.misc.GL_weights(rings, columns)[:, None]
    alm = ducc0.sht.adjoint_synthesis(
        map=(weights * (field @ REC709)).reshape(1, -1), lmax=DEGREE, spin=0, nthreads=1,
        theta=ducc0.misc.GL_thetas(rings), nphi=np.full(rings, columns, dtype=np.uint64), phi0=np.zeros(rings),
        ringstart=np.arange(rings, dtype=np.uint64) * np.uint64(columns),
    )[0]  # fmt: skip
    squares = to_real(alm, DEGREE) ** 2
    l, _ = degrees_and_orders(DEGREE)
    mean = (weights[..., None] * field).sum(axis=(0, 1)) / (4 * np.pi)
    return np.bincount(l, squares) / (2 * np.arange(DEGREE + 1) + 1), 4 * np.pi * mean**2


def features(b):
    odd = np.arange(1, DEGREE, 2)
    from_three = odd[odd >= 3]
    v = [b[:3].sum() / b.sum(), np.mean(b[from_three] / b[from_three + 1])]
    for low, high in ((5, 15), (15, 25), (25, 35), (35, 45)):
        v.append(b[[l for l in odd if low <= l < high]].sum() / b[3] / 5)
    v.append(np.argmax(np.cumsum(b) >= 0.98 * b.sum()))
    return v


snapshot = Snapshot(__file__, oracle=["ducc0", "numpy"], precision="double", tolerance=1e-10)
for seed, count, sharpness in ((500, 4, 2.0), (501, 12, 12.0), (502, 30, 60.0), (503, 40, 600.0)):
    rows = bumps(seed, count, sharpness)
    field = front(picture(rows), 4 * DEGREE, 4 * DEGREE)
    for continuation in ("mirror", "half-turn", "zero"):
        b, colour = power(continued(field, continuation))
        snapshot.case(
            "features", size=SIZE, bumps=rows, continuation=continuation, power=b, colour=colour, features=features(b)
        )
snapshot.write()
