"""Quadrature nodes, values of harmonics and sums over them, in 200-bit arithmetic.

Every quantity is evaluated by the textbook three-term recurrence with enough bits that its own rounding does not matter, at the
exact Gauss–Legendre nodes and at the exact directions that doubles stand for.
"""

import gmpy2
from gmpy2 import mpfr
from snapshot import Snapshot, uniform

gmpy2.get_context().precision = 200
gmpy2.get_context().emin = gmpy2.get_emin_min()
PI = gmpy2.const_pi()


def gauss_node(n, i):
    """Node i from +1 down, and its weight, by Newton's method from the usual guess."""
    x = gmpy2.cos(PI * (4 * i + 3) / (4 * n + 2))
    for _ in range(9):
        before, p = mpfr(0), mpfr(1)
        for k in range(n):
            before, p = p, ((2 * k + 1) * x * p - k * before) / (k + 1)
        slope = n * (before - x * p) / (1 - x * x)
        step = p / slope
        x -= step
        if abs(step) < mpfr(2) ** -110:
            break
    # the slope at the node: (1 − x²) P'' = 2 x P' − n (n+1) P, and P is step · slope there
    slope -= step * (2 * x * slope - n * (n + 1) * p) / (1 - x * x)
    return x, 2 / ((1 - x * x) * slope * slope)


def coefficient_tables(degree, m):
    """a_l and b_l of P_{l+1} = a_l x P_l − b_l P_{l−1}, l = m … degree − 1."""
    a = [gmpy2.sqrt(mpfr(4 * (l + 1) ** 2 - 1) / ((l + 1) ** 2 - m * m)) for l in range(m, degree)]
    return a, [mpfr(0)] + [a[i] / a[i - 1] for i in range(1, len(a))]


def seeds(degree, s):
    """P̄_mm for m = 0 … degree, √2 of the real basis included, at sin θ = s."""
    p = 1 / gmpy2.sqrt(4 * PI)
    out = [p]
    for m in range(1, degree + 1):
        p = p * s * gmpy2.sqrt(mpfr(2 * m + 1) / (2 * m) * (2 if m == 1 else 1))
        out.append(p)
    return out


def angles(direction):
    x, y, z = map(mpfr, direction)
    across = gmpy2.sqrt(x * x + y * y)
    length = gmpy2.sqrt(x * x + y * y + z * z)
    return z / length, across / length, gmpy2.atan2(y, x) if across else mpfr(0)


def value(l, m, direction):
    c, s, phi = angles(direction)
    order = abs(m)
    p = seeds(order, s)[order]
    before = mpfr(0)
    for a, b in zip(*coefficient_tables(l, order)):
        before, p = p, a * c * p - b * before
    return p * (gmpy2.cos(m * phi) if m >= 0 else gmpy2.sin(order * phi))


def ring_sums(degree, rings, columns, seed, shown, shown_columns):
    """Σ f_lm Y_lm at some points of some northern rings and of their mirror images."""
    flat = uniform(seed, (degree + 1) ** 2)
    nodes = [gauss_node(rings, i)[0] for i in shown]
    sines = [gmpy2.sqrt(1 - x * x) for x in nodes]
    starts = [seeds(degree, s) for s in sines]
    totals = [[[mpfr(0), mpfr(0)] for _ in shown_columns] for _ in shown]
    negligible = mpfr(2) ** -140
    for m in range(degree + 1):
        a, b = coefficient_tables(degree, m)
        cosine = [flat[l * l + l + m] for l in range(m, degree + 1)]
        sine = [flat[l * l + l - m] for l in range(m, degree + 1)] if m else [0.0] * (degree + 1)
        turns = [(gmpy2.cos(2 * PI * m * j / columns), gmpy2.sin(2 * PI * m * j / columns)) for j in shown_columns]
        for r, x in enumerate(nodes):
            p, before = starts[r][m], mpfr(0)
            # Far enough beyond degree · sin θ every harmonic of this order is negligible.
            if m > degree * sines[r] + 40 + 12 * (degree * sines[r] + 1) ** (1 / mpfr(3)):
                assert abs(p) < negligible
                continue
            even = [mpfr(0), mpfr(0)]
            odd = [mpfr(0), mpfr(0)]
            for i in range(degree + 1 - m):
                side = odd if i & 1 else even
                side[0] += cosine[i] * p
                side[1] += sine[i] * p
                if i < degree - m:
                    before, p = p, a[i] * x * p - b[i] * before
            for j, (c, s) in enumerate(turns):
                totals[r][j][0] += (even[0] + odd[0]) * c + (even[1] + odd[1]) * s
                totals[r][j][1] += (even[0] - odd[0]) * c + (even[1] - odd[1]) * s
    north = [[float(t[0]) for t in row] for row in totals]
    south = [[float(t[1]) for t in row] for row in totals]
    return north, south


snapshot = Snapshot(__file__, oracle=["gmpy2"], precision="200 bits")

for n in (1, 2, 3, 8, 63, 64, 257, 1024, 2048, 4095, 4096):
    shown = sorted({0, 1, 2, 3, n // 16, n // 4, n // 3, (n - 1) // 2, max(0, (n - 1) // 2 - 1)} & set(range((n + 1) // 2)))
    found = [gauss_node(n, i) for i in shown]
    snapshot.case(
        "rule", nodes=n, shown=shown,
        x=[0.0 if 2 * i + 1 == n else float(x) for i, (x, _) in zip(shown, found)],
        sine=[float(gmpy2.sqrt(1 - x * x)) for x, _ in found],
        weight=[float(w) for _, w in found],
    )  # fmt: skip

DIRECTIONS = [
    (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.6, -0.8, 0.0),
    *[
        tuple(float(v) for v in (gmpy2.sin(mpfr(t)) * gmpy2.cos(mpfr(f)), gmpy2.sin(mpfr(t)) * gmpy2.sin(mpfr(f)), gmpy2.cos(mpfr(t))))
        for t, f in [(1e-2, 0.7), (1e-5, 2.0), (1e-8, -1.1), (3.1, 4.0), (1.5707, 5.5)]
    ],
    *[tuple(uniform(seed, 3)) for seed in range(400, 408)],
]  # fmt: skip
for l in (0, 1, 2, 3, 4, 7, 12, 30, 45, 87, 200, 511, 1024, 2047):
    orders = sorted({0, 1, 2, 3, l // 3, l // 2, l - 2, l - 1, l} & set(range(l + 1)))
    orders = sorted({m for order in orders for m in (order, -order)})
    for direction in DIRECTIONS:
        snapshot.case("value", l=l, direction=direction, m=orders, y=[value(l, m, direction) for m in orders])

for degree, columns, shown in [
    (63, 128, list(range(32))),
    (255, 512, list(range(8)) + list(range(8, 128, 7)) + [124, 125, 126, 127]),
    (2047, 4096, [0, 1, 2, 4, 8, 20, 60, 180, 420, 700, 900, 1000, 1020, 1022, 1023]),
]:
    rings, shown_columns = degree + 1, [0, columns // 7, columns // 2 + 1]
    north, south = ring_sums(degree, rings, columns, 500 + degree, shown, shown_columns)
    snapshot.case(
        "synthesis", degree=degree, rings=rings, columns=columns, seed=500 + degree,
        shown=shown, shown_columns=shown_columns, north=north, south=south,
    )  # fmt: skip
snapshot.write()
