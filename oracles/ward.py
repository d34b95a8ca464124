"""Ward's lobes, their albedo and their zonal coefficients, from the formulas as published.

Lobes: from the half vector itself, 50 digits, at inputs that are doubles. Albedos: over rings tan δ = t, whose inner integral is
closed for two of the lobes; 30 digits. Zonal coefficients at normal incidence: over the light's angle, 30 digits; at
other angles over rings, in 80-bit arithmetic. The crate integrates over rows of another plane: nothing is shared.

Names: the lobe at ρ_s = 1 times the light's cosine, view v = (s, 0, c), half vector h, δ between h and the normal.
"""

import mpmath
import numpy
from mpmath import mp, mpf
from snapshot import Snapshot, reflections

VARIANTS = ["ward1992", "duer", "gmd", "sampled"]


def lobe(variant, sigma_x, sigma_y, view, light, share):
    """f·c_i, in the words of the papers. The directions are doubles, of unit length to a rounding; so that the
    rounding does not matter, h·v is half the length of v + i, which for unit vectors is the same."""
    v, i = [mpf(x) for x in view], [mpf(x) for x in light]
    half = [a + b for a, b in zip(v, i)]
    length = mpmath.sqrt(sum(x * x for x in half))
    h = [x / length for x in half]
    cos_delta, h_dot_v = h[2], length / 2
    tan2_phi = (h[0] / mpf(sigma_x)) ** 2 + (h[1] / mpf(sigma_y)) ** 2  # tan²δ (cos²φ/σ_x² + sin²φ/σ_y²) cos²δ
    gauss = mpmath.exp(-tan2_phi / cos_delta**2) / (4 * mpmath.pi * mpf(sigma_x) * mpf(sigma_y))
    c_i, c_v = i[2], v[2]
    return {
        "ward1992": lambda: gauss / mpmath.sqrt(c_i * c_v) * c_i,
        "duer": lambda: gauss / (c_i * c_v) * c_i,
        "gmd": lambda: gauss / (h_dot_v**2 * cos_delta**4) * c_i,
        "sampled": lambda: gauss / (h_dot_v * cos_delta**3) / share(c_v, mpf(sigma_x)),
    }[variant]()


def rings(sine, cosine, sigma):
    """Break points of t between which every integrand is smooth, ends included."""
    nearest = sine and cosine / (1 + sine) or mpf(1)  # tan of half the elevation
    reach = mpmath.sqrt(-mpmath.log(mpf(10) ** -(mp.dps + 2))) * sigma
    farthest = 1 / nearest
    points = {mpf(0), min(farthest, reach)}
    if nearest < reach:
        points.add(nearest)
        # The scale changes from the edge's to the lobe's.
        step = nearest
        while step < sigma / 4:
            step *= 8
            points.add(step)
    points |= {sigma / 2, sigma, 2 * sigma, 4 * sigma, cosine / sine if sine else mpf(1)}
    end = min(farthest, reach)
    return sorted(p for p in points if 0 <= p <= end)


def open_angle(sine, cosine, t):
    """Half the range of azimuths of the ring t whose light is above the horizon."""
    if t == 0 or sine == 0:
        return mpmath.pi if t < 1 else mpf(0)
    edge = cosine * (t * t - 1) / (2 * sine * t)
    return mpmath.acos(max(mpf(-1), min(mpf(1), edge)))


def over_rings(sine, cosine, sigma, ring):
    """∫ 2t/σ² e^(−t²/σ²) ring(t, φ₀)/2π dt."""

    def integrand(t):
        return 2 * t / sigma**2 * mpmath.exp(-t * t / sigma**2) * ring(t, open_angle(sine, cosine, t)) / (2 * mpmath.pi)

    return mpmath.quad(integrand, rings(sine, cosine, sigma))


def share_above(cosine, sigma):
    with mp.workdps(25):
        sine = mpmath.sqrt((1 - cosine) * (1 + cosine))
        return over_rings(sine, cosine, sigma, lambda t, edge: 2 * edge)


def ring_duer(sine, cosine):
    return lambda t, edge: 2 * (sine * t * mpmath.sin(edge) + cosine * edge) / (cosine * (1 + t * t) ** 2)


def ring_gmd(sine, cosine):
    def ring(t, edge):
        a, b = cosine, sine * t
        if edge == 0:
            return mpf(0)
        if edge == mpmath.pi:
            inner = 2 * mpmath.pi / mpmath.sqrt(a * a - b * b)
        else:
            root = mpmath.sqrt(mpmath.mpc(a * a - b * b))
            inner = (4 / root * mpmath.atan(root / (a + b) * mpmath.tan(edge / 2))).real if root else 2 * mpmath.tan(edge / 2) / a
        return 4 * edge - (1 + t * t) * cosine * inner

    return ring


def albedo(variant, cosine, sigma):
    sine = mpmath.sqrt((1 - cosine) * (1 + cosine))
    make = {"duer": ring_duer, "gmd": ring_gmd}[variant]
    return over_rings(sine, cosine, sigma, make(sine, cosine))


def lobes(snapshot):
    """500 geometries a lobe, from a seed."""
    mp.dps = 50
    for seed, variant in enumerate(VARIANTS):
        for anisotropic in [False, True]:
            if anisotropic and variant == "sampled":
                continue
            seed_ = 500 + 2 * seed + anisotropic
            values = [lobe(variant, *row, share_above) for row in reflections(seed_, 500, anisotropic)]
            snapshot.case("lobe-anisotropic" if anisotropic else "lobe", variant=variant, seed=seed_, values=values)


def fit(snapshot):
    """60 values of each lobe, of which a fit has to find σ."""
    mp.dps = 50
    for seed, variant in enumerate(VARIANTS):
        for k, sigma in enumerate([0.01, 0.1, 0.6]):
            seed_ = 600 + 3 * seed + k
            values = [lobe(variant, *row, share_above) for row in reflections(seed_, 60, False, sigma)]
            snapshot.case("fit", variant=variant, sigma=sigma, seed=seed_, values=values)


COSINES = [1.0, 0.9, 0.5, 0.2, 0.05, 1e-2, 1e-3, 1e-6]


def albedos(snapshot):
    mp.dps = 30
    for sigma in [0.005, 0.03, 0.1, 0.3, 0.5, 1.0]:
        for variant in ["duer", "gmd"]:
            values = [albedo(variant, mpf(cosine), mpf(sigma)) for cosine in COSINES]
            snapshot.case("albedo", variant=variant, sigma=sigma, cosines=COSINES, values=values)
        values = [over_rings_80_bit(sigma, cosine, 0)["ward1992"][0] for cosine in COSINES]
        snapshot.case("albedo", variant="ward1992", sigma=sigma, cosines=COSINES, values=values)
    for sigma in [0.005, 0.03, 0.1, 0.3, 0.5, 1.0]:
        snapshot.case("share", sigma=sigma, cosines=COSINES, values=[share_above(mpf(c), mpf(sigma)) for c in COSINES])


DEGREES = [0, 1, 2, 3, 5, 8, 13, 21, 34, 55, 64, 89, 128, 200, 256]


def gauss_legendre(count):
    """Nodes and weights on (0, 1), by Newton at the working precision."""
    nodes = []
    for k in range(count):
        z = mpmath.cos(mpmath.pi * (k + mpf(3) / 4) / (count + mpf(1) / 2))
        while True:
            p0, p1 = mpf(1), z
            for n in range(1, count):
                p0, p1 = p1, ((2 * n + 1) * z * p1 - n * p0) / (n + 1)
            slope = count * (p0 - z * p1) / (1 - z * z)
            step = p1 / slope
            z -= step
            if abs(step) < mpf(10) ** (-mp.dps + 3):
                break
        nodes.append(((1 - z) / 2, 1 / ((1 - z * z) * slope**2)))
    return nodes


def zonal_normal(snapshot):
    """b_l = 2π ∫ f c_i P_l(cos θ) sin θ dθ at c_v = 1, where δ = θ/2; θ = π/2 − w² undoes √c_i."""
    mp.dps = 30
    rule = gauss_legendre(40)
    for sigma in [0.005, 0.01, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5]:
        top = max(DEGREES)
        end = min(mpmath.pi / 2, 2 * mpmath.atan(mpf(sigma) * 8))
        low, high = mpmath.sqrt(mpmath.pi / 2 - end), mpmath.sqrt(mpmath.pi / 2)
        panels = int(max(12, (high - low) * 2 * high * top / 15))
        sums = {variant: [mpf(0)] * (top + 1) for variant in VARIANTS}
        width = (high - low) / panels
        for panel in range(panels):
            for node, weight in rule:
                w = low + width * (panel + node)
                theta = mpmath.pi / 2 - w * w
                c, s = mpmath.cos(theta), mpmath.sin(theta)
                delta = theta / 2
                gauss = mpmath.exp(-(mpmath.tan(delta) ** 2) / mpf(sigma) ** 2) / (4 * mpmath.pi * mpf(sigma) ** 2)
                measure = weight * width * 2 * w * s * 2 * mpmath.pi
                cos_delta = mpmath.cos(delta)
                values = {
                    "ward1992": gauss * mpmath.sqrt(c),
                    "duer": gauss,
                    "gmd": gauss * c / cos_delta**6,
                    "sampled": gauss / cos_delta**4 / -mpmath.expm1(-1 / mpf(sigma) ** 2),
                }
                legendre = [mpf(1), c]
                for l in range(1, top):
                    legendre.append(((2 * l + 1) * c * legendre[-1] - l * legendre[-2]) / (l + 1))
                for variant in VARIANTS:
                    scale, sum_ = measure * values[variant], sums[variant]
                    for l in DEGREES:
                        sum_[l] += scale * legendre[l]
        for variant in VARIANTS:
            snapshot.case("zonal-normal", variant=variant, sigma=sigma, degrees=DEGREES, values=[sums[variant][l] for l in DEGREES])


def over_rings_80_bit(sigma, cosine, top, density=1):
    """b_0 … b_top of every lobe about the mirror direction: rings of t, azimuths within the open angle.

    density multiplies the number of nodes; 1 and 2 agree to 1e-15.
    """
    mp.dps = 30
    real = numpy.longdouble
    pi = 4 * numpy.arctan(real(1))
    xs, ws = (numpy.array([real(str(entry)) for entry in column]) for column in zip(*gauss_legendre(40)))
    c, sig = real(cosine), real(sigma)
    s = numpy.sqrt((1 - c) * (1 + c))
    nearest = c / (1 + s)
    end = min(1 / nearest, real(6.7) * sig)
    breaks = [real(0)]
    if nearest < end:
        breaks += [nearest / 2, nearest]
        step = nearest / 16
        while step < end / 4:
            breaks.append(nearest + step)
            step *= 2
    breaks.append(end)
    sums = {variant: numpy.zeros(top + 1, dtype=real) for variant in VARIANTS}
    mass = real(0)
    for low, high in zip(breaks[:-1], breaks[1:]):
        panels = density * int(max(1, numpy.ceil((high - low) / min(sig, real(0.4)) * 1.5), numpy.ceil((high - low) * top / 20)))
        for panel in range(panels):
            a = low + (high - low) * panel / panels
            b = low + (high - low) * (panel + 1) / panels
            for node, weight in zip(xs, ws):
                # Both ends of a piece may be branch points of the inner integral.
                t = a + (b - a) * node * node * (3 - 2 * node)
                dt = (b - a) * 6 * node * (1 - node) * weight
                if t <= nearest:
                    # Periodic, and smooth but near t = nearest.
                    count = density * 1200
                    phi = (numpy.arange(count, dtype=real) + real(0.5)) * (pi / count)
                    dphi = numpy.full(count, pi / count * 2)
                else:
                    edge = numpy.arccos(max(real(-1), min(real(1), c * (t * t - 1) / (2 * s * t))))
                    parts = density * 12
                    u = ((numpy.arange(parts, dtype=real)[:, None] + xs[None, :]) / parts).ravel()
                    phi = edge * (1 - (1 - u) ** 2)
                    dphi = numpy.tile(ws, parts) / parts * 2 * edge * (1 - u) * 2
                x, tan2 = t * numpy.cos(phi), t * t
                light = numpy.maximum((2 * s * x + c * (1 - tan2)) / (1 + tan2), 0)
                measure = 2 * t / sig**2 * numpy.exp(-tan2 / sig**2) / (2 * pi) * dt * dphi
                middle = (light + c) / 2
                weights = {
                    "ward1992": middle / (1 + tan2) * numpy.sqrt(light / c),
                    "duer": middle / (1 + tan2) / c,
                    "gmd": light / middle,
                    "sampled": numpy.ones_like(light),
                }
                mass += measure.sum()
                # i·r from the vectors themselves.
                to_view = s * x + c
                i_x, i_z = 2 * to_view * x / (1 + tan2) - s, 2 * to_view / (1 + tan2) - c
                z = -s * i_x + c * i_z
                before, value = numpy.ones_like(z), z
                rows = numpy.stack([measure * weights[v] for v in VARIANTS])
                for l in range(top + 1):
                    for v, term in zip(VARIANTS, rows @ before):
                        sums[v][l] += term
                    before, value = value, ((2 * l + 3) * z * value - (l + 1) * before) / (l + 2)
    sums["sampled"] = sums["sampled"] / mass
    return sums


def zonal_oblique(snapshot):
    for sigma, cosine, top in [
        (0.03, 0.866, 256), (0.1, 0.5, 128), (0.1, 0.866, 64), (0.1, 0.15, 64), (0.1, 0.02, 64), (0.3, 0.7, 64), (0.5, 0.5, 64), (0.03, 0.02, 64),
        (0.005, 0.3, 256), (0.5, 0.05, 34),
        # The horizon cuts rows aside of the plane of incidence, 6.3 σ from the peak, and not the row in it.
        (0.05, 0.575, 128),
    ]:  # fmt: skip
        sums = over_rings_80_bit(sigma, cosine, top)
        degrees = [l for l in DEGREES if l <= top]
        for variant in VARIANTS:
            values = [float(sums[variant][l]) for l in degrees]
            snapshot.case("zonal-oblique", variant=variant, sigma=sigma, cosine=cosine, degrees=degrees, values=values)


def main():
    snapshot = Snapshot(
        __file__, oracle=["mpmath", "numpy"], tolerance=1e-15,
        precision="lobes 50 digits; albedos 30; zonal at normal incidence 30; oblique, and albedos of ward1992, 80-bit: 1e-15 by doubling the nodes",
    )  # fmt: skip
    lobes(snapshot)
    fit(snapshot)
    albedos(snapshot)
    zonal_normal(snapshot)
    zonal_oblique(snapshot)
    snapshot.write()


if __name__ == "__main__":
    main()
