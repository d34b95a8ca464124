"""The operator of one view by brute force: T_lm(theta) = integral of lobe times real harmonic, in half-vector coordinates.

Shares nothing with the crate: the crate integrates in the light's polar angle with Bessel functions and turns the
result with Wigner's d; this walks the half vector's slope plane with composite Gauss-Legendre panels graded towards
both ends of the ray and adaptive Gauss-Kronrod over its azimuth, and takes the harmonics from SciPy.

usage: python oracles/view_operator.py   (some minutes)
"""

import numpy
from scipy.integrate import quad_vec
from scipy.special import sph_harm_y

from snapshot import Snapshot

HARMONICS = [(0, 0), (1, 1), (7, 0), (31, 31), (64, 20), (128, 90), (256, 0), (256, 100)]
X, W = numpy.polynomial.legendre.leggauss(20)


def real_harmonics(x, y, z):
    """The cosine harmonics, orthonormal, no Condon-Shortley phase."""
    theta = numpy.arctan2(numpy.hypot(x, y), z)
    phi = numpy.arctan2(y, x)
    out = []
    for l, m in HARMONICS:
        value = sph_harm_y(l, m, theta, phi).real
        out.append(value if m == 0 else value * numpy.sqrt(2) * (-1) ** m)
    return numpy.array(out)


def lobe(variant, sigma, ci, cv, hv, cos_delta):
    tan2 = 1 / cos_delta**2 - 1
    e = numpy.exp(-tan2 / sigma**2) / (4 * numpy.pi * sigma**2)
    if variant == "ward1992":
        return e * numpy.sqrt(ci / cv)
    if variant == "duer":
        return e / cv
    if variant == "gmd":
        return e * ci / (hv**2 * cos_delta**4)
    return e / (hv * cos_delta**3)


def ray(length, first):
    """Nodes and weights on [0, length]: panels that double from `first` to the middle and halve again to the end,
    the last by the square so that a root at the end is smooth."""
    panels = int(numpy.ceil(max(4, 30 * length)))  # degree 256 turns by 17 in one
    left = [0.0]
    step = min(first, length / panels)
    while left[-1] + step < length / 2:
        left.append(left[-1] + step)
        step = min(2 * step, length / panels)
    edges = numpy.array(left + [length / 2])
    nodes, weights = [], []
    for a, b in zip(edges[:-1], edges[1:]):
        nodes.append(a + (b - a) * (X + 1) / 2)
        weights.append(W * (b - a) / 2)
    # the other half, t = length (1 - s^2 / 2)
    for k in range(panels):
        s = (k + (X + 1) / 2) / panels
        nodes.append(length * (1 - s * s / 2))
        weights.append(W / (2 * panels) * length * s)
    return numpy.concatenate(nodes), numpy.concatenate(weights)


def operator(variant, sigma, theta, view_angle):
    """T_lm at normal angle theta for every harmonic; the view direction leans by view_angle from the normal towards
    the axis and beyond it."""
    s, c = numpy.sin(view_angle), numpy.cos(view_angle)
    cut = 6.6 * sigma

    def limit(phi):
        return (s * numpy.cos(phi) + numpy.sqrt((s * numpy.cos(phi)) ** 2 + c * c)) / c

    def integrand(phi):
        length = min(limit(phi), cut)
        t, w = ray(length, c / 4)
        # local frame: normal +z, view (s, 0, c)
        n = 1 / numpy.sqrt(1 + t * t)
        h = numpy.array([t * numpy.cos(phi) * n, t * numpy.sin(phi) * n, n])
        hv = h[0] * s + h[2] * c
        i = 2 * hv * h - numpy.array([[s], [0.0], [c]])
        # the light's cosine without cancellation near the horizon
        full = limit(phi)
        other = (s * numpy.cos(phi) - numpy.sqrt((s * numpy.cos(phi)) ** 2 + c * c)) / c
        ci = c * (full - t) * (t - other) * n * n
        f = lobe(variant, sigma, ci, c, hv, n)
        # to the frame of the view axis: the view leans towards -x there
        x, y, z = -i[0], -i[1], i[2]
        X_, Z_ = numpy.cos(theta) * x + numpy.sin(theta) * z, -numpy.sin(theta) * x + numpy.cos(theta) * z
        jacobian = 4 * hv * n**3 * t
        kernel = f * jacobian * w
        values = (real_harmonics(X_, y, Z_) * kernel).sum(axis=1)
        return numpy.concatenate([values, [kernel.sum()]])

    breaks = [numpy.pi / 2]
    if limit(0.0) > cut > limit(numpy.pi):
        lo, hi = 0.0, numpy.pi
        for _ in range(200):
            mid = (lo + hi) / 2
            lo, hi = (mid, hi) if limit(mid) > cut else (lo, mid)
        breaks.append(lo)
    result, error = quad_vec(integrand, 0, numpy.pi, epsabs=2e-13, epsrel=1e-13, points=breaks, norm="max", limit=400)
    if error > 2e-11:
        raise RuntimeError(f"{variant} {sigma} {theta}: error {error}")
    values = 2 * result[:-1]
    if variant == "sampled":
        values = values / (2 * result[-1])
    return values, 2 * error


def main():
    snapshot = Snapshot(
        __file__,
        oracle=["numpy", "scipy"],
        precision="quadrature error below 2e-11 by its own estimate, 1e-13 as a rule",
        tolerance=1e-11,
    )
    plan = [
        ("gmd", 0.1, 0.6, 2.0),
        ("ward1992", 0.03, 0.4, 1.2),
        ("duer", 0.3, 1.2, 5.0),
        ("gmd", 0.001, 0.7, None),
        ("gmd", 1.0, 0.9, None),
        ("gmd", 0.02, 1.5706, None),
        ("ward1992", 0.1, 1.5706, None),
        ("sampled", 0.3, 1.5706, None),
        ("gmd", 0.1, 0.0, None),
    ]
    for sigma, thetas in [(0.005, [0.02, 1.55]), (0.05, [0.8, 1.55]), (0.5, [1.55])]:
        for theta in thetas:
            for variant in ["ward1992", "duer", "gmd", "sampled"]:
                plan.append((variant, sigma, theta, None))
    for variant, sigma, theta, distance in plan:
        view = theta if distance is None else theta + numpy.arctan2(numpy.sin(theta), distance - numpy.cos(theta))
        values, error = operator(variant, sigma, theta, view)
        print(variant, sigma, theta, distance, f"error {error:.1e}", flush=True)
        snapshot.case(
            "specular",
            variant=variant,
            sigma=sigma,
            theta=theta,
            distance=0.0 if distance is None else distance,
            harmonics=[list(pair) for pair in HARMONICS],
            values=values.tolist(),
        )
    snapshot.write()


if __name__ == "__main__":
    main()
