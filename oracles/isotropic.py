"""ρ̂_lpq of Ward's lobes, f c_i = Σ ρ̂_lpq Y_lq(light) Y_pq(view): a product of three double-exponential rules over directions.

ρ̂_lpq = ∫∫ f c_i Y_lq(i) Y_pq(v) dω_i dω_v = 2π ∫ sin θ_v Y_pq(θ_v, 0) ∫ sin θ_i Y_lq(θ_i, 0) ∫ f c_i cos q(φ_i − φ_v) dφ (and half of that, twice over, for q > 0).
Tanh-sinh nodes crowd at every end, where √c_i has its branch, 1/(c_v + c_i) its pole, and a grazing lobe its needle in φ. Half vectors are made
and normalised as the papers have them. Two thirds of the step move the answers by less than the stated precision, which is asserted.
"""

import numpy as np
import scipy.special
from snapshot import Snapshot

DEGREE = 6


def tanh_sinh(length, step):
    """Nodes of (0, length), their distances from both ends, and weights."""
    t = np.arange(-int(3.6 / step), int(3.6 / step) + 1) * step
    u = np.pi / 2 * np.sinh(t)
    near = length / (1 + np.exp(-2 * u))  # from the lower end, exact to the last digit beside it
    far = length / (1 + np.exp(2 * u))
    return near, far, step * np.pi / 2 * np.cosh(t) / (2 * np.cosh(u) ** 2) * length


def harmonics(theta):
    """Y_lq at azimuth 0, real, orthonormal, without the Condon-Shortley phase, [l, q, direction]."""
    table = np.zeros((DEGREE + 1, DEGREE + 1, len(theta)))
    for l in range(DEGREE + 1):
        for q in range(l + 1):
            value = scipy.special.sph_harm_y(l, q, theta, 0.0).real
            table[l, q] = value if q == 0 else np.sqrt(2) * (-1) ** q * value
    return table


def coefficients(sigma, step):
    """ρ̂ of each lobe, [l, p, q]."""
    theta, elevation, weight = tanh_sinh(np.pi / 2, step)
    phi, back, phi_weight = tanh_sinh(np.pi, step)
    cosine, sine = np.sin(elevation), np.sin(theta)
    y = harmonics(theta)
    turns = np.cos(np.arange(DEGREE + 1)[:, None] * phi)  # azimuth from the view's
    cos_phi, sin_phi = np.where(phi < back, np.cos(phi), -np.cos(back)), np.where(phi < back, np.sin(phi), np.sin(back))
    sums = {variant: np.zeros((DEGREE + 1,) * 3) for variant in ("ward1992", "gmd", "sampled")}
    for v in range(len(theta)):
        s, c = sine[v], cosine[v]
        si, ci = sine[:, None], cosine[:, None]
        half = np.stack(np.broadcast_arrays(s + si * cos_phi, si * sin_phi, c + ci))
        # s + s_i cos φ near φ = π, by what the two lack of each other.
        half[0] = np.where(phi > back, 2 * np.cos((theta[v] + theta[:, None]) / 2) * np.sin((theta[v] - theta[:, None]) / 2) + si * 2 * np.sin(back / 2) ** 2, half[0])
        h = half / np.sqrt((half**2).sum(0))
        dot = h[0] * s + h[2] * c
        gauss = np.exp(-(h[0] ** 2 + h[1] ** 2) / (h[2] * sigma) ** 2) / (4 * np.pi * sigma**2)
        measure = 2 * phi_weight * (weight * sine)[:, None]  # both sides of the plane of incidence
        density = gauss / (dot * h[2] ** 3)
        lobes = {
            "ward1992": gauss * np.sqrt(ci / c),
            "gmd": gauss * ci / (dot**2 * h[2] ** 4),
            "sampled": density / (density * measure).sum(),
        }
        for variant, lobe in lobes.items():
            by_order = (lobe * measure) @ turns.T  # [light, q]
            from_light = np.einsum("lqi,iq->lq", y, by_order)
            outer = np.einsum("lq,pq->lpq", from_light, y[:, :, v])
            outer *= weight[v] * s * np.pi
            outer[:, :, 0] *= 2
            sums[variant] += outer
    return sums


snapshot = Snapshot(__file__, oracle=["numpy", "scipy"], precision="2e-14 by a step of two thirds", tolerance=1e-12)
for sigma in (0.15, 0.5):
    coarse, fine = coefficients(sigma, 1 / 32), coefficients(sigma, 1 / 48)
    for variant, values in fine.items():
        moved = np.abs(values - coarse[variant]).max()
        assert moved < 2e-14, f"{variant} σ {sigma} moved by {moved}"
        entries = [(l, p, q) for l in range(DEGREE + 1) for p in range(DEGREE + 1) for q in range(min(l, p) + 1)]
        snapshot.case("coefficients", variant=variant, sigma=sigma, degree=DEGREE, values=[values[e] for e in entries])
snapshot.write()
