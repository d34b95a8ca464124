"""Beams by healpy, gradients by mpmath from the polynomials themselves, random fields by numpy's PCG64 and mpmath.

Coefficients are made from a seed (`uniform`), in the order l² + l + m; so are those of the random fields.
"""

from fractions import Fraction

import mpmath
import numpy as np
from convention import degrees_and_orders
from mpmath import mpf
from snapshot import Snapshot, uniform

import healpy

mpmath.mp.dps = 50


def polynomial(l, m):
    """Q of P_l^m = sin^m θ Q(cos θ), without the Condon-Shortley phase: d^m/dx^m of Legendre's, from the lowest power."""
    coefficients = [Fraction(0)] * (l + 1)
    for k in range(l // 2 + 1):
        sign = -1 if k % 2 else 1
        top = Fraction(factorial(2 * l - 2 * k), 2**l * factorial(k) * factorial(l - k) * factorial(l - 2 * k))
        coefficients[l - 2 * k] = sign * top
    for _ in range(m):
        coefficients = [i * c for i, c in enumerate(coefficients)][1:]
    return coefficients


def factorial(n):
    return int(mpmath.factorial(n))


def value(coefficients, x):
    return mpmath.polyval([mpf(c.numerator) / c.denominator for c in reversed(coefficients)], x)


def colatitudes(grid, rings):
    """θ of each ring: Gauss-Legendre nodes by mpmath, or equal steps with the poles."""
    if grid == "clenshaw-curtis":
        return [mpmath.pi * i / (rings - 1) for i in range(rings)]
    guesses = np.polynomial.legendre.leggauss(rings)[0][::-1]
    legendre = polynomial(rings, 0)
    return [mpmath.acos(mpmath.findroot(lambda x: value(legendre, x), mpf(float(guess)))) for guess in guesses]


def gradient(grid, rings, columns, degree, seed):
    """∂f/∂θ and (1/sin θ) ∂f/∂φ at each point; sin^m θ is divided by sin θ before either is a number."""
    wanted = uniform(seed, (degree + 1) ** 2)
    columns_of = {}
    for l, m in zip(*degrees_and_orders(degree)):
        columns_of.setdefault(abs(int(m)), []).append((int(l), int(m), wanted[l * l + l + m]))
    tables = {}
    for l in range(degree + 1):
        for m in range(l + 1):
            q = polynomial(l, m)
            norm = mpmath.sqrt((2 - (m == 0)) * mpf(2 * l + 1) / (4 * mpmath.pi) * mpmath.factorial(l - m) / mpmath.factorial(l + m))
            tables[l, m] = norm, q, [i * c for i, c in enumerate(q)][1:]
    south, east = [], []
    for theta in colatitudes(grid, rings):
        cos, sin = mpmath.cos(theta), mpmath.sin(theta)
        of_order = {}
        for m, entries in columns_of.items():
            parts = [mpf(0)] * 4  # of ∂/∂θ with the cosine and the sine, of P/sin θ likewise
            for l, order, f in entries:
                norm, q, slope = tables[l, m]
                by_theta = -(sin ** (m + 1)) * value(slope, cos) if slope else mpf(0)
                if m > 0:
                    by_theta += m * sin ** (m - 1) * cos * value(q, cos)
                    parts[2 + (order < 0)] += f * norm * sin ** (m - 1) * value(q, cos)
                parts[order < 0] += f * norm * by_theta
            of_order[m] = parts
        for column in range(columns):
            phi = 2 * mpmath.pi * column / columns
            terms = [(m, mpmath.cos(m * phi), mpmath.sin(m * phi), p) for m, p in of_order.items()]
            south.append(float(sum(p[0] * c + p[1] * s for _, c, s, p in terms)))
            east.append(float(sum(m * (p[3] * c - p[2] * s) for m, c, s, p in terms)))
    return south, east


def seeded(seed):
    """numpy's PCG64 in the state in which rand_core's seed_from_u64 and rand_pcg leave theirs: a PCG32 fills 32 bytes."""
    mask = (1 << 64) - 1
    words = []
    for _ in range(8):
        seed = (seed * 6364136223846793005 + 11634580027462260723) & mask
        shifted = (((seed >> 18) ^ seed) >> 27) & 0xFFFFFFFF
        turn = seed >> 59
        words.append(((shifted >> turn) | (shifted << (-turn & 31))) & 0xFFFFFFFF)
    state, increment = (sum(word << (32 * i) for i, word in enumerate(words[at : at + 4])) for at in (0, 4))
    increment |= 1
    whole = (1 << 128) - 1
    multiplier = 0x2360ED051FC65DA44385DF649FCCF645
    state = ((state + increment) * multiplier + increment) & whole
    generator = np.random.PCG64()
    generator.state = {"bit_generator": "PCG64", "state": {"state": state, "inc": increment}, "has_uint32": 0, "uinteger": 0}
    return generator


def random_field(power, seed):
    generator = seeded(seed)
    normals = []
    while len(normals) < len(power) ** 2:
        u, v = (mpf(int(word) >> 11) / 2**53 for word in generator.random_raw(2))
        radius = mpmath.sqrt(-2 * mpmath.log(1 - u))
        normals += [radius * mpmath.cos(2 * mpmath.pi * v), radius * mpmath.sin(2 * mpmath.pi * v)]
    return [float(mpmath.sqrt(mpf(power[l])) * n) for l, n in zip(degrees_and_orders(len(power) - 1)[0], normals)]


snapshot = Snapshot(__file__, oracle=["healpy", "mpmath", "numpy"], precision="50 digits; beams in double", tolerance=1e-12)
for fwhm in (0.0, 1e-3, 0.0174532925199433, 0.2, 1.5):
    snapshot.case("beam", degree=64, fwhm=fwhm, values=healpy.gauss_beam(fwhm, lmax=64))
for seed, (grid, rings, columns, degree) in enumerate(
    [("clenshaw-curtis", 10, 18, 8), ("gauss-legendre", 13, 26, 12), ("gauss-legendre", 25, 50, 24)], start=700
):
    south, east = gradient(grid, rings, columns, degree, seed)
    snapshot.case("gradient", grid=grid, rings=rings, columns=columns, degree=degree, seed=seed, south=south, east=east)
for seed in (0, 1, 20261127, (1 << 53) - 1):
    power = [1.0 / (l + 1.0) ** 2 for l in range(12)]
    snapshot.case("random", seed=seed, power=power, coefficients=random_field(power, seed))
snapshot.write()
