"""Lambert in frequency: ρ̂_l and A_l = ∫ max(cos θ, 0) P_l(cos θ) dω, by exact rational arithmetic, and far out by Γ.

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


def far(degree):
    """A_l of an even l by Γ: 2π (−1)^(n−1) C(2n, n)/4ⁿ/((l + 2)(l − 1)), n = l/2, with C(2n, n)/4ⁿ = Γ(n + ½)/(√π Γ(n + 1))."""
    n = degree // 2
    with mpmath.workdps(90):
        ratio = mpmath.exp(mpmath.loggamma(n + mpmath.mpf(1) / 2) - mpmath.loggamma(n + 1))
        sign = 1 if n % 2 else -1
        return sign * 2 * mpmath.sqrt(mpmath.pi) * ratio / (degree + 2) / (degree - 1)


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
    # The closed form against the polynomial's integral, before it is asked for what that cannot reach.
    for degree in (2, 4, 256, 1024):
        exact = half_integral(degree)
        polynomial = 2 * mpmath.pi * mpmath.mpf(exact.numerator) / exact.denominator
        assert abs(far(degree) / polynomial - 1) < mpmath.mpf(10) ** -45, degree
    degrees = [2**20 + 2, 2**20 + 4, 2**20 + 6, 2**21, 10**7, 2**31 + 2, 2**40, 10**15, 2**53]
    transfers = [far(degree) for degree in degrees]
    coefficients = [a / mpmath.sqrt(4 * mpmath.pi / (2 * l + 1)) for a, l in zip(transfers, degrees)]
    snapshot.case(
        "far",
        degrees=degrees,
        transfers=[high_and_low(value)[0] for value in transfers],
        coefficients=[high_and_low(value)[0] for value in coefficients],
    )
    snapshot.write()


if __name__ == "__main__":
    main()
