"""Sums of harmonics at directions by the definition, in 40 digits: mpmath alone, by Legendre's recurrence in l.

Coefficients are made from a seed (`uniform`), in the order l² + l + m.
"""

import mpmath
from mpmath import mpf
from snapshot import Snapshot, uniform

mpmath.mp.dps = 40


def legendre(degree, m, cosine, sine):
    """P̄_lm for l = m … degree, orthonormal for real harmonics, without the Condon–Shortley phase."""
    value = mpf(1)
    for k in range(1, m + 1):
        value *= mpf(2 * k + 1) / (2 * k)
    value = mpmath.sqrt(value * (2 if m else 1) / (4 * mpmath.pi)) * sine**m
    before, values = mpf(0), [value]
    for l in range(m + 1, degree + 1):
        a = mpmath.sqrt(mpf(4 * l * l - 1) / (l * l - m * m))
        b = mpmath.sqrt(mpf((l - 1) ** 2 - m * m) / (4 * (l - 1) ** 2 - 1)) if l > m + 1 else mpf(0)
        before, value = value, a * (cosine * value - b * before)
        values.append(value)
    return values


def check():
    for l, m in [(0, 0), (3, 0), (5, 2), (9, 9), (12, 7)]:
        theirs = mpmath.spherharm(l, m, mpf(1), 0) * (-1) ** m * (mpmath.sqrt(2) if m else 1)
        assert abs(legendre(l, m, mpmath.cos(1), mpmath.sin(1))[-1] - theirs) < 1e-30, (l, m)


def total(degree, coefficients, direction):
    x, y, z = map(mpf, direction)
    length = mpmath.sqrt(x * x + y * y + z * z)
    cosine, sine = z / length, mpmath.hypot(x, y) / length
    turn = mpmath.mpc(x, y) / mpmath.hypot(x, y) if x or y else mpmath.mpc(1)
    value, power = mpf(0), mpmath.mpc(1)
    for m in range(degree + 1):
        for l, p in zip(range(m, degree + 1), legendre(degree, m, cosine, sine)):
            at = l * l + l
            value += p * (coefficients[at + m] * power.real + (coefficients[at - m] * power.imag if m else 0))
        power *= turn
    return float(value)


check()
snapshot = Snapshot(__file__, oracle=["mpmath"], precision="40 digits")
u = uniform(1300, 30)
directions = [u[i : i + 3] for i in range(0, 30, 3)]
# The poles and beside them, on the equator, on both sides of the azimuths 0 and π.
directions += [(0, 0, 1), (0, 0, -1), (1e-9, 2e-9, 1), (-1e-5, 1e-5, -2), (0, 1, 0), (1, 0, 0), (-1, 0, 0)]
directions += [(1, 1e-12, 0.5), (1, -1e-12, 0.5), (-1, 1e-12, 0.5), (-1, -1e-12, 0.5)]
for degree in (0, 1, 6, 33, 64):
    coefficients = uniform(1310 + degree, (degree + 1) ** 2)
    values = [total(degree, coefficients, direction) for direction in directions]
    snapshot.case("sums", degree=degree, seed=1310 + degree, directions=directions, values=values)
snapshot.write()
