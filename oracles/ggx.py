"""The GGX lobe: Fresnel's equations, D, G2, the lobe, its density and its sampler, its albedo and its zonal coefficients, from the formulas as published.

Values: 50 digits, at inputs that are doubles. Zonal coefficients and x K1(x): 30 and 50 digits. Albedos: 80-bit arithmetic over rays of the plane of
slopes, from the peak to the horizon, on panels halved towards both ends; the script first checks on the same rays that the density of visible normals
integrates to 1, and against panels of other nodes. The crate integrates over rows of that plane, and in another variable along the normal.
"""

import mpmath
import numpy
from mpmath import mp, mpf
from snapshot import Snapshot, reflections, uniform

# F0 = 0.04; glass; gold and silver in the green; a strong absorber of low index.
FRESNELS = [
    ("constant", [1.0]), ("schlick", [0.04]), ("dielectric", [1.5]), ("dielectric", [2.4]), ("conductor", [0.47, 2.4]), ("conductor", [0.13, 3.2]),
    ("conductor", [3.1, 3.3]),
]  # fmt: skip


def fresnel(kind, parameters, c):
    """The reflectance in the words of optics: amplitudes from Snell's law, whose cosine is complex."""
    p = [mpf(x) for x in parameters]
    if kind == "constant":
        return p[0]
    if kind == "schlick":
        return p[0] + (1 - p[0]) * (1 - c) ** 5
    index = mpmath.mpc(*p)
    refracted = mpmath.sqrt(1 - (1 - c * c) / index**2)
    s = (c - index * refracted) / (c + index * refracted)
    t = (index * c - refracted) / (index * c + refracted)
    return (abs(s) ** 2 + abs(t) ** 2) / 2


def smith(alpha, direction):
    """Λ."""
    x, y, z = direction
    return (mpmath.sqrt(1 + ((alpha[0] * x) ** 2 + (alpha[1] * y) ** 2) / z**2) - 1) / 2


def lobe(kind, parameters, alpha_x, alpha_y, view, light):
    """f·c_i, D, G2 and the density of the draws. h·v is half the length of v + i, which for unit vectors is the same."""
    v, i = [mpf(x) for x in view], [mpf(x) for x in light]
    alpha = [mpf(alpha_x), mpf(alpha_y)]
    half = [a + b for a, b in zip(v, i)]
    length = mpmath.sqrt(sum(x * x for x in half))
    h = [x / length for x in half]
    stretched = (h[0] / alpha[0]) ** 2 + (h[1] / alpha[1]) ** 2 + h[2] ** 2
    d = 1 / (mpmath.pi * alpha[0] * alpha[1] * stretched**2)
    g2, g1 = 1 / (1 + smith(alpha, v) + smith(alpha, i)), 1 / (1 + smith(alpha, v))
    value = fresnel(kind, parameters, length / 2) * d * g2 / (4 * v[2])
    return value, d, g2, g1 * d / (4 * v[2])


def sample(kind, parameters, alpha, view, u):
    """The light and the weight F G2/G1 of two numbers: a uniform point of the cap z > −v'_z, about which the stretched view is reflected."""
    v, alpha = [mpf(x) for x in view], [mpf(x) for x in alpha]
    stretched = [alpha[0] * v[0], alpha[1] * v[1], v[2]]
    length = mpmath.sqrt(sum(x * x for x in stretched))
    w = [x / length for x in stretched]
    phi, z = 2 * mpmath.pi * mpf(u[0]), (1 - mpf(u[1])) * (1 + w[2]) - w[2]
    r = mpmath.sqrt(1 - z * z)
    m = [alpha[0] * (r * mpmath.cos(phi) + w[0]), alpha[1] * (r * mpmath.sin(phi) + w[1]), z + w[2]]
    length = mpmath.sqrt(sum(x * x for x in m))
    h = [x / length for x in m]
    dot = sum(a * b for a, b in zip(h, v))
    light = [2 * dot * a - b for a, b in zip(h, v)]
    if light[2] <= 0:
        return light, mpf(0)
    weight = (1 + smith(alpha, v)) / (1 + smith(alpha, v) + smith(alpha, light))
    return light, weight * fresnel(kind, parameters, dot)


def values(snapshot):
    mp.dps = 50
    cosines = [1.0, 0.95, 0.7, 0.5, 0.3, 0.1, 0.01, 1e-3, 1e-6, 0.0]
    for kind, parameters in [*FRESNELS, ("dielectric", [1.01]), ("dielectric", [10.0]), ("conductor", [1.5, 0.0]), ("conductor", [0.05, 8.0])]:
        # At the horizon every boundary reflects all; 0/0 of the amplitudes is not met, all indices being other than 1.
        answers = [fresnel(kind, parameters, mpf(c)) for c in cosines]
        snapshot.case("fresnel", kind=kind, parameters=parameters, cosines=cosines, values=answers)
    for seed, (kind, parameters) in enumerate(FRESNELS):
        for anisotropic in [False, True]:
            seed_ = 700 + 2 * seed + anisotropic
            rows = [lobe(kind, parameters, *row) for row in reflections(seed_, 200, anisotropic)]
            names = ["values", "distributions", "maskings", "densities"]
            answers = {name: [row[k] for row in rows] for k, name in enumerate(names) if k % 3 == 0 or kind == "constant"}
            snapshot.case("lobe", kind=kind, parameters=parameters, seed=seed_, **({"distributions": [], "maskings": []} | answers))
    # The ends of α, at half vectors of another width than the lobe's: peaks and far tails.
    for seed, (alpha, sigma) in enumerate([(0.001, 0.001), (0.001, 0.05), (0.001, 0.7), (1.0, 1.0), (1.0, 0.01)]):
        rows = [lobe("constant", [1.0], alpha, alpha, view, light) for _, _, view, light in reflections(750 + seed, 100, False, sigma)]
        snapshot.case("ends", alpha=alpha, sigma=sigma, seed=750 + seed, values=[r[0] for r in rows], densities=[r[3] for r in rows])
    numbers = iter(uniform(760, 1000))
    for kind, parameters, alpha in [("constant", [1.0], [0.1, 0.1]), ("dielectric", [1.5], [0.4, 0.4]), ("conductor", [0.47, 2.4], [0.05, 0.3]),
                                    ("constant", [1.0], [0.001, 0.001]), ("schlick", [0.04], [1.0, 1.0])]:  # fmt: skip
        for _, _, view, _ in reflections(770, 8, False, 0.1):
            pairs = [[0.5 * (next(numbers) + 1.0), 0.5 * (next(numbers) + 1.0)] for _ in range(8)]
            drawn = [sample(kind, parameters, alpha, view, u) for u in pairs]
            snapshot.case(
                "sample", kind=kind, parameters=parameters, alpha=alpha, view=view, numbers=pairs, lights=[d[0] for d in drawn], weights=[d[1] for d in drawn]
            )  # fmt: skip


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


def zonal(snapshot):
    """b_l = ∫ f c_i P_l(cos θ) dω seen along the normal, over the light's angle θ, of which the half vector has half; every third of an octave a panel, and
    none longer than what P_256 bears. Of a lobe of two widths the mean over azimuth by the trapezoidal rule of 400 nodes."""
    mp.dps = 30
    rule = gauss_legendre(40)
    masks = ["smith", "absent", "gmd"]
    for alpha, kind, parameters in [
        ([0.001] * 2, "constant", [1.0]), ([0.01] * 2, "constant", [1.0]), ([0.03] * 2, "constant", [1.0]), ([0.1] * 2, "constant", [1.0]),
        ([0.3] * 2, "constant", [1.0]), ([1.0] * 2, "constant", [1.0]), ([0.1] * 2, "dielectric", [1.5]), ([0.3] * 2, "conductor", [0.47, 2.4]),
        ([0.2, 0.5], "constant", [1.0]),
    ]:  # fmt: skip
        round_ = alpha[0] == alpha[1]
        a, b = mpf(alpha[0]), mpf(alpha[1])
        turns = [(mpf(1), mpf(0))] if round_ else [(mpmath.cospi(mpf(k) / 400) ** 2, mpmath.sinpi(mpf(k) / 400) ** 2) for k in range(400)]
        end = mpmath.pi / 2
        # Towards the horizon in 1/2, 1/4 ... of the rest, where c_i nears 0; from the normal in α/4 · 2^(k/3).
        points, at = [mpf(0)], a / 4
        while at < end:
            points.append(at)
            at = min(at * mpf(2) ** (mpf(1) / 3), at + mpf(30) / max(DEGREES))
        points += [end - end / mpf(2) ** k for k in range(1, 60)] + [end]
        points = sorted(points)
        sums = {m: [mpf(0)] * len(DEGREES) for m in masks}
        for low, high in zip(points[:-1], points[1:]):
            if high - low < mpf(10) ** -25:
                continue
            for node, weight in rule:
                theta = low + (high - low) * node
                c, s = mpmath.cos(theta), mpmath.sin(theta)
                delta = theta / 2
                tan2, cos_delta = mpmath.tan(delta) ** 2, mpmath.cos(delta)
                measure = weight * (high - low) * 2 * mpmath.pi * s * fresnel(kind, parameters, cos_delta) / 4
                d, smiths = mpf(0), mpf(0)
                for x2, y2 in turns:
                    one = 1 / (mpmath.pi * a * b * cos_delta**4 * (1 + tan2 * (x2 / a**2 + y2 / b**2)) ** 2)
                    d += one / len(turns)
                    smiths += one / len(turns) * 2 * c / (c + mpmath.sqrt(c * c + s * s * (a * a * x2 + b * b * y2)))
                parts = {"smith": smiths, "absent": d, "gmd": d * c / cos_delta**2}
                p0, p1, l = mpf(1), c, 0
                for k, degree in enumerate(DEGREES):
                    while l < degree:
                        p0, p1, l = p1, ((2 * l + 3) * c * p1 - (l + 1) * p0) / (l + 2), l + 1
                    for m in masks:
                        sums[m][k] += measure * parts[m] * p0
        for m in masks:
            snapshot.case("zonal", kind=kind, parameters=parameters, alpha=alpha, masking=m, degrees=DEGREES, values=sums[m])


def bessel(snapshot):
    mp.dps = 50
    degrees = [1, 2, 3, 7, 20, 64, 200, 349, 1024, 100000]
    for alpha in [0.001, 0.01, 0.1, 0.3, 1.0]:
        chosen = [l for l in degrees if 2 * alpha * l < 700]
        x = [2 * mpf(alpha) * mpmath.sqrt(mpf(l) * (l + 1)) for l in chosen]
        snapshot.case("bessel", alpha=alpha, degrees=chosen, values=[t * mpmath.besselk(1, t) for t in x])


REAL = numpy.longdouble


def halved(low, high, first, last):
    """Panels of [low, high], halved `first` times towards the one end and `last` times towards the other."""
    points = {REAL(0), REAL(1)} | {REAL(2) ** -k for k in range(1, first)} | {1 - REAL(2) ** -k for k in range(1, last)}
    points = numpy.array(sorted(points))
    return low + (high - low) * points


def nodes_of(points, rule):
    xs, ws = rule
    widths = numpy.diff(points)
    return (points[:-1, None] + widths[:, None] * xs).ravel(), (widths[:, None] * ws).ravel()


def over_rays(alpha, view, rule, of):
    """∫ of(…) D cos⁴δ dx dy over the slopes x, y whose light is above the horizon, along rays from the peak; u and w are the slopes along the surface's
    tangents, x and y those along the view's azimuth and across. With of = None it is ∫ max(0, s x + c) D cos⁴δ dx dy, what the view sees of all facets,
    which has to be (1 + Λ) c."""
    pi = 4 * numpy.arctan(REAL(1))
    c = REAL(view[2])
    s = numpy.sqrt((1 - c) * (1 + c))
    along = numpy.hypot(REAL(view[0]), REAL(view[1]))
    turn = (REAL(view[0]) / along, REAL(view[1]) / along) if along > 0 else (REAL(1), REAL(0))
    a, b = REAL(alpha[0]), REAL(alpha[1])
    # Quarters of the view's frame, in which the horizon is reached at once, and of the tangents', along which a lobe of two widths is drawn out. Both sides
    # of the plane of incidence are alike for a lobe of one width.
    quarters, sides = [k * pi / 2 for k in range(5)], 1 if a == b else 2
    if sides == 2:
        turned = numpy.arctan2(-turn[1], turn[0])
        quarters = sorted({*quarters, *((turned + k * pi / 2) % (2 * pi) for k in range(4))})
    total = REAL(0)
    for low, high in zip(quarters[: -1 if sides == 2 else 2], quarters[1:]):
        phis, weights = nodes_of(halved(REAL(0), high - low, 24, 24), rule)
        # The distance from the quarter is what has to keep its digits.
        base = numpy.round(low / (pi / 2)) * (pi / 2)
        rest, k = phis + (low - base), int(numpy.round(low / (pi / 2))) % 4
        cosines = {0: numpy.cos(rest), 1: -numpy.sin(rest), 2: -numpy.cos(rest), 3: numpy.sin(rest)}[k]
        sines = {0: numpy.sin(rest), 1: numpy.cos(rest), 2: -numpy.sin(rest), 3: -numpy.cos(rest)}[k]
        for cos, sin, weight in zip(cosines, sines, weights):
            if of is None:
                end = -c / (s * cos) if s * cos < 0 else REAL(1e18)
            else:
                root = numpy.sqrt((s * cos) ** 2 + c * c)
                end = (s * cos + root) / c if cos >= 0 else c / (root - s * cos)
            ts, dts = nodes_of(halved(REAL(0), end, 100 if of is None else 36, 24), rule)
            x, y = ts * cos, ts * sin
            u, w = x * turn[0] - y * turn[1], x * turn[1] + y * turn[0]
            density = ts / (pi * a * b * (1 + (u / a) ** 2 + (w / b) ** 2) ** 2)
            toward = s * x + c
            terms = density * toward if of is None else density * of(x, y, u, w, ts, toward, end)
            total += weight * (terms * dts).sum()
    return total * 2 / sides


def fresnel_80_bit(kind, parameters, c):
    p = [REAL(x) for x in parameters]
    if kind == "constant":
        return p[0]
    if kind == "schlick":
        return p[0] + (1 - p[0]) * (1 - c) ** 5
    index = p[0] + 1j * p[1] if len(p) > 1 else p[0]
    refracted = numpy.sqrt(1 - (1 - c * c) / index**2)
    s = (c - index * refracted) / (c + index * refracted)
    t = (index * c - refracted) / (index * c + refracted)
    return (abs(s) ** 2 + abs(t) ** 2) / 2


def albedo(kind, parameters, alpha, view, rule):
    a, b = REAL(alpha[0]), REAL(alpha[1])
    v = [REAL(x) for x in view]
    c = v[2]
    s = numpy.sqrt((1 - c) * (1 + c))
    stretched = c * numpy.sqrt(1 + ((a * v[0]) ** 2 + (b * v[1]) ** 2) / c**2)

    def weight(x, y, u, w, t, toward, end):
        secant2 = 1 + t * t
        # c_i from the ray's two ends, one of which is behind the peak: t runs to `end`, and the other is −1/end.
        light_z = c * (end - t) * (t + 1 / end) / secant2
        i = [2 * toward * u / secant2 - v[0], 2 * toward * w / secant2 - v[1]]
        light = numpy.sqrt(light_z**2 + (a * i[0]) ** 2 + (b * i[1]) ** 2)
        return fresnel_80_bit(kind, parameters, toward / numpy.sqrt(secant2)) * 2 * light_z / (light_z * stretched + c * light) * toward

    return float(over_rays(alpha, view, rule, weight))


def view_at(cosine, azimuth):
    sine = ((1.0 - cosine) * (1.0 + cosine)) ** 0.5
    return [sine * azimuth[0], sine * azimuth[1], cosine]


def albedos(snapshot):
    mp.dps = 30
    rule, fine = ([numpy.array([REAL(str(x)) for x in column]) for column in zip(*gauss_legendre(n))] for n in (12, 16))
    for alpha, cosine in [([0.1, 0.1], 0.5), ([0.4, 0.2], 0.05)]:
        view = view_at(cosine, (0.6, 0.8))
        a = [mpf(x) for x in alpha]
        want = (1 + smith(a, [mpf(x) for x in view])) * mpf(view[2])
        got = over_rays(alpha, view, fine, None)
        assert abs(got / REAL(str(want)) - 1) < 1e-15, f"the visible normals of {alpha} at {cosine}: {got} for {want}"
        twice = albedo("dielectric", [1.5], alpha, view, fine)
        once = albedo("dielectric", [1.5], alpha, view, rule)
        assert abs(twice / once - 1) < 1e-15, f"{alpha} {cosine}: {twice} and {once}"
    cosines = [1.0, 0.9, 0.5, 0.2, 0.05, 1e-2, 1e-3, 1e-6]
    for alpha in [0.001, 0.01, 0.1, 0.3, 1.0]:
        views = [view_at(c, (1.0, 0.0)) for c in cosines]
        snapshot.case(
            "albedo", kind="constant", parameters=[1.0], alpha=[alpha] * 2, views=views,
            values=[albedo("constant", [1.0], [alpha] * 2, view, rule) for view in views],
        )  # fmt: skip
    for (kind, parameters), alpha in [
        (FRESNELS[1], [0.2, 0.2]), (FRESNELS[2], [0.05, 0.05]), (FRESNELS[4], [0.5, 0.5]), (FRESNELS[0], [0.1, 0.4]), (FRESNELS[6], [0.02, 1.0]),
    ]:  # fmt: skip
        views = [view_at(c, (0.6, 0.8)) for c in [0.9, 0.3, 0.01]]
        snapshot.case("albedo", kind=kind, parameters=parameters, alpha=alpha, views=views, values=[albedo(kind, parameters, alpha, v, fine) for v in views])


def main():
    snapshot = Snapshot(
        __file__, oracle=["mpmath", "numpy"], tolerance=1e-15,
        precision="values 50 digits; zonal coefficients 30; albedos 80-bit: 1e-15 by panels of other nodes",
    )  # fmt: skip
    values(snapshot)
    zonal(snapshot)
    bessel(snapshot)
    albedos(snapshot)
    snapshot.write()


if __name__ == "__main__":
    main()
