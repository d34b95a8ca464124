"""Between this project's real harmonics and the complex coefficients of healpy and ducc0.

Ours: real, orthonormal, no Condon-Shortley phase, here in the order l² + l + m with m < 0 for sin |m|φ.
Theirs: complex, orthonormal, with the phase, m ≥ 0 only, ordered by m and then l.
"""

import numpy as np


def degrees_and_orders(degree):
    """l and m of each real coefficient."""
    l = np.concatenate([np.full(2 * l + 1, l) for l in range(degree + 1)])
    m = np.concatenate([np.arange(-l, l + 1) for l in range(degree + 1)])
    return l, m


def to_complex(real, degree):
    """Their coefficients of the same field."""
    real = np.asarray(real)
    columns = []
    for m in range(degree + 1):
        l = np.arange(m, degree + 1)
        cosine, sine = real[l * l + l + m], real[l * l + l - m]
        columns.append(cosine + 0j if m == 0 else (-1) ** m * (cosine - 1j * sine) / np.sqrt(2))
    return np.concatenate(columns)


def to_real(alm, degree):
    """Our coefficients of the same field."""
    real = np.zeros((degree + 1) ** 2)
    start = 0
    for m in range(degree + 1):
        l = np.arange(m, degree + 1)
        column = alm[start : start + len(l)]
        start += len(l)
        if m == 0:
            real[l * l + l] = column.real
        else:
            real[l * l + l + m] = (-1) ** m * np.sqrt(2) * column.real
            real[l * l + l - m] = -((-1) ** m) * np.sqrt(2) * column.imag
    return real
