"""Lambert in frequency: ρ̂_l and A_l = ∫ max(cos θ, 0) P_l(cos θ) dω, by exact rational arithmetic.

A_l is 2π ∫₀¹ x P_l(x) dx with the polynomial's integer coefficients, so the only rounding is the last one.
"""

from fractions import Fraction
from math import comb

import mpmath
from snapshot import Snapshot, high_and_low

mpmath.mp.dps = 50


def half_integral(degree):
    """∫₀¹ x P_l(x) dx, exactly, from P_l(x) = 2^-l Σ_k (−1)^k C(l,k) C(2l−2k,l) x^(l−2k)."""
    total = Fraction(0)
    for k in range(degree // 2 + 1):
        total += Fraction((-1) ** k * comb(degree, k) * comb(2 * degree - 2 * k, degree), degree - 2 * k + 2)
    return total / 2**degree


def main():
    snapshot = Snapshot(__file__, oracle=["mpmath"], precision="exact rationals, rounded once from 50 digits")
    degrees = list(range(0, 257)) + [511, 512, 1023, 1024]
    transfers, coefficients = [], []
    for degree in degrees:
        exact = half_integral(degree)
        transfer = 2 * mpmath.pi * mpmath.mpf(exact.numerator) / exact.denominator
        transfers.append(high_and_low(transfer)[0])
        coefficients.append(high_and_low(transfer / mpmath.sqrt(4 * mpmath.pi / (2 * degree + 1)))[0])
    snapshot.case("kernel", degrees=degrees, transfers=transfers, coefficients=coefficients)
    snapshot.write()


if __name__ == "__main__":
    main()
