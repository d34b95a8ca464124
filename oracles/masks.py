"""The coupling of degrees by a mask of given power.

M_ll' = (2l'+1)/4π Σ_L (2L+1) W_L (l l' L; 0 0 0)². For low degrees the square of the 3j symbol is half the integral of three Legendre
polynomials, as a rational number; for high ones its closed form in factorials, which is held against that integral here.
"""

import math
import platform
from fractions import Fraction

from snapshot import Snapshot, uniform


def legendre(l):
    """P_l from the lowest power, by Rodrigues' formula."""
    coefficients = [Fraction(0)] * (l + 1)
    for k in range(l // 2 + 1):
        top = (-1) ** k * math.factorial(2 * l - 2 * k)
        coefficients[l - 2 * k] = Fraction(top, 2**l * math.factorial(k) * math.factorial(l - k) * math.factorial(l - 2 * k))
    return coefficients


def product(a, b):
    out = [Fraction(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def half_integral(coefficients):
    return sum(c / (i + 1) for i, c in enumerate(coefficients) if i % 2 == 0)


def exact(degree, power):
    polynomials = [legendre(l) for l in range(2 * degree + 1)]
    rows = []
    for l in range(degree + 1):
        for other in range(degree + 1):
            pair = product(polynomials[l], polynomials[other])
            total = sum(Fraction(2 * L + 1) * Fraction(power[L]) * half_integral(product(pair, polynomials[L])) for L in range(2 * degree + 1))
            rows.append(float(total) * (2 * other + 1) / (4 * math.pi))
    return rows


def square_of_three_j(l, other, big):
    """(l l' L; 0 0 0)² by its closed form, in factorials of whole numbers."""
    n = l + other + big
    if n % 2 or not abs(l - other) <= big <= l + other:
        return 0
    f, g = math.factorial, n // 2
    root = Fraction(f(g), f(g - l) * f(g - other) * f(g - big))
    return root * root * f(n - 2 * l) * f(n - 2 * other) * f(n - 2 * big) / f(n + 1)


def closed(power, shown):
    out = []
    for l, other in shown:
        terms = [(2 * L + 1) * power[L] * float(square_of_three_j(l, other, L)) for L in range(abs(l - other), l + other + 1)]
        out.append(math.fsum(terms) * (2 * other + 1) / (4 * math.pi))
    return out


def powers(seed, degree):
    """Falling as those of a mask do."""
    return [(u + 1.5) / (L + 1.0) ** 2 for L, u in enumerate(uniform(seed, 2 * degree + 1))]


snapshot = Snapshot(__file__, oracle={"python": platform.python_version()}, precision="rational numbers, rounded once a term", tolerance=1e-12)
for seed, degree in [(900, 0), (901, 3), (902, 9)]:
    power = powers(seed, degree)
    snapshot.case("exact", degree=degree, power=power, matrix=exact(degree, power))
degree, power = 300, powers(903, 300)
shown = [(l, other) for l in (0, 1, 2, 50, 51, 177, 299, 300) for other in (0, 1, 3, 49, 50, 176, 178, 298, 300)]
for l, other, big in [(0, 0, 0), (2, 3, 5), (4, 4, 2), (5, 3, 4), (6, 2, 5)]:
    assert square_of_three_j(l, other, big) == half_integral(product(product(legendre(l), legendre(other)), legendre(big)))
snapshot.case("closed", degree=degree, power=power, shown=shown, values=closed(power, shown))
snapshot.write()
