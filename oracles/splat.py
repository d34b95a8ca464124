"""Rotated sets of coefficients of degree 3 and 4, in the bases that splats are kept in: test vectors for whoever rotates them, CC0.

The basis is mpmath's associated Legendre functions in the frame and with the signs of each convention, held to the polynomials that 3DGS,
glTF and e3nn print. What a rotation makes of a set is found from the field itself: f(R⁻¹ ω) at as many directions as a degree has
coefficients, and the linear equations for them.
"""

import mpmath
from mpmath import mpf
from snapshot import Snapshot, uniform

mpmath.mp.dps = 50
BASES = ["3dgs", "gltf", "e3nn", "lobes"]
# x, y, z, w, of unit length to the last digit but one: general, quarter turns, a third of a turn about (1, 1, 1), half a turn, hardly any.
HALF = 0.7071067811865476
QUATERNIONS = [
    (0.3, 0.5, -0.1, 0.806225774829855),
    (-0.64, 0.48, 0.36, -0.48),
    (HALF, 0.0, 0.0, HALF),
    (0.0, HALF, 0.0, HALF),
    (0.0, 0.0, HALF, HALF),
    (0.5, 0.5, 0.5, 0.5),
    (0.0, 0.6, 0.8, 0.0),
    (6e-4, 0.0, 8e-4, 0.9999995),
]


def harmonic(basis, l, m, direction):
    x, y, z = direction
    if basis == "e3nn":  # the pole on y, the azimuth from z towards x
        x, y, z = z, x, y
    order = abs(m)
    # legenp has the sign (−1)^m of Condon and Shortley.
    legendre = (-1) ** order * mpmath.legenp(l, order, z)
    scale = mpmath.sqrt(mpf(2 * l + 1) / (4 * mpmath.pi) * mpmath.factorial(l - order) / mpmath.factorial(l + order))
    azimuth = mpmath.atan2(y, x)
    value = scale * legendre * (mpmath.cos(order * azimuth) if m >= 0 else mpmath.sin(order * azimuth))
    if m:
        value *= mpmath.sqrt(2)
    return value * (-1) ** order if basis in ("3dgs", "gltf") else value


def check_against_what_is_printed():
    direction = [mpf("0.48"), mpf("-0.64"), mpf("0.6")]
    x, y, z = direction
    root = mpmath.sqrt
    inria = {
        (1, -1): -0.4886025119029199 * y,
        (1, 0): 0.4886025119029199 * z,
        (1, 1): -0.4886025119029199 * x,
        (2, -2): 1.0925484305920792 * x * y,
        (2, -1): -1.0925484305920792 * y * z,
        (2, 0): 0.31539156525252005 * (2 * z * z - x * x - y * y),
        (2, 1): -1.0925484305920792 * x * z,
        (2, 2): 0.5462742152960396 * (x * x - y * y),
        (3, -3): -0.5900435899266435 * y * (3 * x * x - y * y),
        (3, -2): 2.890611442640554 * x * y * z,
        (3, -1): -0.4570457994644658 * y * (4 * z * z - x * x - y * y),
        (3, 0): 0.3731763325901154 * z * (2 * z * z - 3 * x * x - 3 * y * y),
        (3, 1): -0.4570457994644658 * x * (4 * z * z - x * x - y * y),
        (3, 2): 1.445305721320277 * z * (x * x - y * y),
        (3, 3): -0.5900435899266435 * x * (x * x - 3 * y * y),
        (4, -4): 2.5033429417967046 * x * y * (x * x - y * y),
        (4, -1): -0.6690465435572892 * y * z * (7 * z * z - 3),
        (4, 3): -1.7701307697799304 * x * z * (x * x - 3 * y * y),
    }
    # e3nn's, which are √(4π) times as large.
    e3nn = {
        (1, -1): root(3) * x,
        (1, 0): root(3) * y,
        (1, 1): root(3) * z,
        (2, -2): root(15) * x * z,
        (2, -1): root(15) * x * y,
        (2, 0): root(5) * (y * y - (x * x + z * z) / 2),
        (2, 1): root(15) * y * z,
        (2, 2): root(15) / 2 * (z * z - x * x),
        (3, -3): root(42) / 6 * root(15) * (x * z * z + x * (z * z - x * x) / 2),
        (3, -1): root(168) / 8 * x * (4 * y * y - x * x - z * z),
        (3, 0): root(7) / 2 * y * (2 * y * y - 3 * (x * x + z * z)),
        (3, 3): root(42) / 6 * root(15) * (z * (z * z - x * x) / 2 - x * x * z),
    }
    for (l, m), value in inria.items():
        assert abs(value - harmonic("3dgs", l, m, direction)) < 1e-14, (l, m)
    for (l, m), value in e3nn.items():
        assert abs(value / root(4 * mpmath.pi) - harmonic("e3nn", l, m, direction)) < 1e-14, (l, m)


def rotate(quaternion, point):
    x, y, z, w = map(mpf, quaternion)
    n = x * x + y * y + z * z + w * w
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), w * w - x * x + y * y - z * z, 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), w * w - x * x - y * y + z * z],
    ]
    return [sum(a * b for a, b in zip(row, point)) / n for row in rows]


def place(basis, degree, l, m):
    """Where a coefficient lies; this crate's own order is by m, l contiguous, cosines before sines."""
    if basis != "lobes":
        return l * l + l + m
    before = sum((degree + 1 - k) * (2 if k else 1) for k in range(abs(m)))
    return before + (degree + 1 - abs(m) if m < 0 else 0) + l - abs(m)


def directions(seed, count):
    numbers = iter(uniform(seed, 3 * count))
    found = []
    for _ in range(count):
        point = [mpf(next(numbers)) for _ in range(3)]
        length = mpmath.sqrt(sum(c * c for c in point))
        found.append([c / length for c in point])
    return found


def rotated(basis, degree, quaternion, coefficients):
    back = [-c for c in quaternion[:3]] + [quaternion[3]]
    out = [None] * len(coefficients)
    for l in range(degree + 1):
        orders = range(-l, l + 1)
        points = directions(40 + l, 2 * l + 1)
        matrix = mpmath.matrix([[harmonic(basis, l, m, point) for m in orders] for point in points])
        values = [
            sum(mpf(coefficients[place(basis, degree, l, m)]) * harmonic(basis, l, m, rotate(back, point)) for m in orders)
            for point in points
        ]
        for m, value in zip(orders, mpmath.lu_solve(matrix, mpmath.matrix(values))):
            out[place(basis, degree, l, m)] = float(value)
    return out


check_against_what_is_printed()
snapshot = Snapshot(__file__, oracle=["mpmath"], precision="50 digits")
snapshot.provenance["licence"] = "CC0-1.0"
for basis in BASES:
    for degree in (3, 4):
        for number, quaternion in enumerate(QUATERNIONS):
            coefficients = [round(c, 6) for c in uniform(1200 + number, (degree + 1) ** 2)]
            direction = (0.48, -0.64, 0.6)
            value = sum(
                mpf(coefficients[place(basis, degree, l, m)]) * harmonic(basis, l, m, list(map(mpf, direction)))
                for l in range(degree + 1)
                for m in range(-l, l + 1)
            )
            snapshot.case(
                "rotated",
                basis=basis,
                degree=degree,
                quaternion=quaternion,
                coefficients=coefficients,
                rotated=rotated(basis, degree, quaternion, coefficients),
                direction=direction,
                turned=[float(c) for c in rotate(quaternion, list(map(mpf, direction)))],
                value=float(value),
            )
snapshot.write()
