"""Wigner's d and D by their closed sums, with as many digits as those cancel and thirty more.

d^l_m'm(β) = ⟨l m'| e^(−iβ J_y) |l m⟩ and D = e^(−im'α) d e^(−imγ) for R = Z(α) Y(β) Z(γ). That D turns the coefficients of a field with
R is checked here on the field itself, by mpmath's own harmonics.
"""

import mpmath
from mpmath import mpf
from snapshot import Snapshot, uniform

BETAS = [1e-9, 0.1, 1.0, 1.5707963267948966, 2.5, 3.1415926, -2.0, 12.3]
DEGREES = [1, 2, 5, 20, 64, 200, 512]
# x, y, z, w: general, of another length, next to the pole, next to half a turn, about the pole.
QUATERNIONS = [(0.3, 0.5, -0.2, 0.8), (-3.0, 1.0, 2.0, 0.5), (1e-9, 2e-9, 0.3, 1.0), (0.6, -0.8, 1e-9, 1e-8), (0.0, 0.0, 0.4, 0.9)]


def small_d(l, row, column, cos, sin):
    """The sum over s of Wigner's formula; cos and sin are of β/2."""
    f = mpmath.factorial
    root = mpmath.sqrt(f(l + row) * f(l - row) * f(l + column) * f(l - column))
    total = mpf(0)
    for s in range(max(0, column - row), min(l + column, l - row) + 1):
        term = cos ** (2 * l + column - row - 2 * s) * sin ** (row - column + 2 * s)
        total += (-1) ** (row - column + s) * term / (f(l + column - s) * f(s) * f(row - column + s) * f(l - row - s))
    return root * total


def orders(l, seed):
    """All pairs (m', m) of a low degree; of a high one those of the corners and some in between."""
    if l <= 5:
        return [(row, column) for row in range(-l, l + 1) for column in range(-l, l + 1)]
    pairs = [(l, l), (l, -l), (-l, l), (0, 0), (l, 0), (0, l), (1, -1), (l - 1, 3)]
    numbers = iter(uniform(seed, 48))
    while len(pairs) < 28:
        pairs.append(tuple(max(-l, min(l, round(next(numbers) * l))) for _ in range(2)))
    # Where β is small or near π, what is not 0 lies near the diagonals.
    return pairs + [(l // 3, l // 3 + 1), (-l // 2, -l // 2), (l // 3, -l // 3), (2 - l // 2, l // 2)]


def digits(l):
    mpmath.mp.dps = 40 + int(0.7 * l)


def angles(quaternion):
    """(cos β/2, sin β/2, α, γ) of R = Z(α) Y(β) Z(γ)."""
    x, y, z, w = map(mpf, quaternion)
    length = mpmath.sqrt(x * x + y * y + z * z + w * w)
    plus = mpmath.atan2(z, w)
    minus = mpmath.atan2(-x, y) if x or y else mpf(0)
    return mpmath.hypot(w, z) / length, mpmath.hypot(x, y) / length, plus + minus, plus - minus


def large_d(l, row, column, quaternion):
    cos, sin, alpha, gamma = angles(quaternion)
    return mpmath.expj(-row * alpha) * small_d(l, row, column, cos, sin) * mpmath.expj(-column * gamma)


def rotate(quaternion, point):
    x, y, z, w = map(mpf, quaternion)
    length = mpmath.sqrt(x * x + y * y + z * z + w * w)
    x, y, z, w = x / length, y / length, z / length, w / length
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return [sum(a * b for a, b in zip(row, point)) for row in rows]


def harmonic(l, m, point):
    theta, phi = mpmath.atan2(mpmath.hypot(point[0], point[1]), point[2]), mpmath.atan2(point[1], point[0])
    return mpmath.spherharm(l, m, theta, phi)


def check_the_sense():
    digits(3)
    point = [mpf("0.48"), mpf("0.64"), mpf("0.6")]
    for quaternion in QUATERNIONS:
        turned = rotate(quaternion, point)
        for column in range(-3, 4):
            # The field Y_3m, turned: its value at R x is that of Y_3m at x.
            value = sum(large_d(3, row, column, quaternion) * harmonic(3, row, turned) for row in range(-3, 4))
            assert abs(value - harmonic(3, column, point)) < 1e-30, "the sense of the rotation is misread"


check_the_sense()
snapshot = Snapshot(__file__, oracle=["mpmath"], precision="40 digits and 0.7 for each degree")
for degree in DEGREES:
    for number, beta in enumerate(BETAS):
        digits(degree)
        pairs = orders(degree, 900 + number)
        cos, sin = mpmath.cos(mpf(beta) / 2), mpmath.sin(mpf(beta) / 2)
        values = [float(small_d(degree, row, column, cos, sin)) for row, column in pairs]
        snapshot.case("small-d", degree=degree, beta=beta, orders=pairs, values=values)
for degree in (2, 33, 512):
    for number, quaternion in enumerate(QUATERNIONS):
        digits(degree)
        pairs = orders(degree, 950 + number)
        values = [large_d(degree, row, column, quaternion) for row, column in pairs]
        snapshot.case(
            "large-d",
            degree=degree,
            quaternion=quaternion,
            orders=pairs,
            real=[float(value.real) for value in values],
            imaginary=[float(value.imag) for value in values],
        )
snapshot.write()
