"""What users of other libraries compute with them: over three hundred cases, each answered by the library itself.

Every case says its source: the library and its version, the test or example of its own whose kind of question this is, and the function that
answered. The questions are of that kind and the numbers are made here: no line and no file of a peer is in them. Arguments are random, from
`uniform`, whole degrees at a time.
"""

import ducc0
import healpy
import numpy as np
import pyshtools
import pyshtools.backends.shtools as shtools
import scipy.special
import sphericart
from convention import degrees_and_orders
from peers_tools import pairs, random, seeds, some, source
from snapshot import Snapshot

snapshot = Snapshot(
    __file__, oracle=["scipy", "healpy", "ducc0", "pyshtools", "sphericart"], precision="double", tolerance=1e-12
)  # fmt: skip


def angles(count):
    z, turn = random(2, count)
    return np.arccos(z), np.pi * (turn + 1)


def directions(theta, phi):
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)


def complex_set(seed, degree, orders=None):
    """a_lm for m ≥ 0 by order; those of order 0 are real."""
    orders = degree if orders is None else orders
    m = np.array([m for m in range(orders + 1) for l in range(m, degree + 1)])
    re, im = random(2, m.size, seed=seed)
    return re + 1j * np.where(m == 0, 0.0, im)


def by_degree(real, degree):
    """SHTOOLS' arrays of real coefficients in the order l² + l + m."""
    l, m = degrees_and_orders(degree)
    cilm = np.zeros((2, degree + 1, degree + 1))
    cilm[np.where(m < 0, 1, 0), l, np.abs(m)] = real
    return cilm


# Single harmonics in the convention of each library.

def harmonic(who, kind, degree, order, theta, phi, values, normalisation="ortho", phase=False):
    snapshot.case(
        "harmonic", source=who, kind=kind, normalisation=normalisation, condon_shortley=phase, degree=degree, order=order,
        directions=directions(theta, phi), values=pairs(values),
    )  # fmt: skip


for degree, orders in [(0, [0]), (1, [-1, 0, 1]), (2, [-2, -1, 0, 1, 2]), (4, [-3, 0, 4]), (11, [-11, -4, 7]), (40, [-40, -1, 0, 23]), (100, [50, 100])]:
    for order in orders:
        theta, phi = angles(6)
        values = scipy.special.sph_harm_y(degree, order, theta, phi)
        harmonic(source("scipy", "special/tests/test_sph_harm.py::TestSphHarm::test_all", "sph_harm_y"), "complex", degree, order, theta, phi, values, phase=True)
for normalisation in ("4pi", "ortho", "schmidt"):
    for phase in (1, -1):
        for degree, order in [(0, 0), (1, 1), (3, -2), (6, 0), (12, 5), (30, -29)]:
            theta, phi = angles(5)
            values = [
                pyshtools.expand.spharm_lm(degree, order, t, p, normalization=normalisation, kind="real", csphase=phase, degrees=False)
                for t, p in zip(theta, phi)
            ]
            harmonic(source("pyshtools", "examples/python/TestLegendre/TestLegendre.py", "expand.spharm_lm"), "real", degree, order, theta, phi, values, normalisation, phase == -1)
for degree in (1, 4, 9, 18):
    theta, phi = angles(5)
    table = sphericart.SphericalHarmonics(degree).compute(directions(theta, phi))
    for order in (-degree, 0, degree // 2):
        harmonic(
            source("sphericart", "python/tests/test_vs_scipy.py", "SphericalHarmonics.compute"), "real", degree, order, theta, phi, table[:, degree * degree + degree + order]
        )

# Rules.
for count in (1, 2, 5, 16, 33, 64):
    x, w = scipy.special.roots_legendre(count)
    snapshot.case("rule", source=source("scipy", "special/tests/test_orthogonal.py::test_roots_legendre", "roots_legendre"), grid="gauss-legendre", rings=count, cosines=x[::-1], weights=w[::-1])
    x, w = shtools.SHGLQ(count - 1)
    snapshot.case("rule", source=source("pyshtools", "examples/python/TimingAccuracy/TimingAccuracyGLQ.py", "SHGLQ"), grid="gauss-legendre", rings=count, cosines=x, weights=w)
    snapshot.case(
        "rule", source=source("ducc0", "python/test/test_misc.py", "misc.GL_thetas, GL_weights"), grid="gauss-legendre", rings=count,
        cosines=np.cos(ducc0.misc.GL_thetas(count)), weights=ducc0.misc.GL_weights(count, 1) / (2 * np.pi),
    )  # fmt: skip
for kind, grid in [("CC", "clenshaw-curtis"), ("F1", "fejer")]:
    for count in (3, 4, 9, 32, 65):
        steps = np.arange(count) / (count - 1) if kind == "CC" else (np.arange(count) + 0.5) / count
        snapshot.case(
            "rule", source=source("ducc0", "python/test/test_sht.py::test_2d_roundtrip", "sht.get_gridweights"), grid=grid, rings=count,
            cosines=np.cos(np.pi * steps), weights=ducc0.sht.get_gridweights(kind, count) / (2 * np.pi),
        )  # fmt: skip

# Legendre functions.
for degree, x in [(1, 0.3), (7, -0.9), (20, 0.999), (64, 0.05), (200, -0.5)]:
    snapshot.case("polynomials", source=source("scipy", "special/tests/test_legendre.py::TestLegendreP", "legendre_p_all"), x=x, values=scipy.special.legendre_p_all(degree, x).ravel())
    snapshot.case("polynomials", source=source("pyshtools", "examples/python/TestLegendre/TestLegendre.py", "PLegendre"), x=x, values=shtools.PLegendre(degree, x))
for degree, x in [(2, 0.5), (5, -0.7), (12, 0.99), (30, 0.1)]:
    l = np.arange(degree + 1)
    plain = shtools.PlmON(degree, x, csphase=1, cnorm=1)
    for m in (0, 1, 2, degree // 2, degree):
        column = [plain[k * (k + 1) // 2 + m] for k in range(m, degree + 1)]
        # Complex harmonics: 1/√2 of the real ones for m > 0.
        snapshot.case(
            "legendre", source=source("pyshtools", "examples/python/TestLegendre/TestLegendre.py", "PlmON"), degree=degree, order=m, x=x,
            values=np.array(column) * (np.sqrt(2) if m else 1),
        )  # fmt: skip

# Synthesis and analysis on grids and the adjoints, of a_lm and of white noise by seed.

def on_grid(operation, who, grid, rings, columns, degree, orders, seed, answer, **more):
    snapshot.case(
        operation, source=who, grid=grid, rings=rings, columns=columns, degree=degree, orders=orders, seed=seed, **some(answer), **more
    )


for kind, grid in [("CC", "clenshaw-curtis"), ("F1", "fejer"), ("GL", "gauss-legendre")]:
    for degree, orders in [(2, 0), (2, 2), (5, 5), (11, 10), (11, 11), (32, 32)]:
        rings, columns = degree + 1 if kind == "GL" else 2 * degree + 2, 2 * orders + 2
        options = dict(lmax=degree, mmax=orders, spin=0, geometry=kind, nthreads=1)
        numbers = (grid, rings, columns, degree, orders)
        roundtrip, adjoint = (f"python/test/test_sht.py::test_2d_{name}" for name in ("roundtrip", "adjoint"))
        seed = next(seeds)
        alm = complex_set(seed, degree, orders)[None]
        on_grid("synthesis", source("ducc0", roundtrip, "sht.synthesis_2d"), *numbers, seed, ducc0.sht.synthesis_2d(alm=alm, ntheta=rings, nphi=columns, **options))
        # Of maps beyond the band ducc0 makes something else on Fejér's grid than the rule's sum.
        if kind != "F1":
            answer = ducc0.sht.adjoint_analysis_2d(alm=alm, ntheta=rings, nphi=columns, **options)
            on_grid("adjoint-analysis", source("ducc0", adjoint, "sht.adjoint_analysis_2d"), *numbers, seed, answer)
        seed = next(seeds)
        noise = random(1, rings, columns, seed=seed)
        if kind != "F1":
            on_grid("analysis", source("ducc0", roundtrip, "sht.analysis_2d"), *numbers, seed, ducc0.sht.analysis_2d(map=noise, **options))
        on_grid("adjoint-synthesis", source("ducc0", adjoint, "sht.adjoint_synthesis_2d"), *numbers, seed, ducc0.sht.adjoint_synthesis_2d(map=noise, **options))
for nside, degree in [(1, 1), (2, 3), (2, 4), (4, 8), (5, 9), (8, 16), (8, 23), (16, 32)]:
    numbers = ("healpix", 4 * nside - 1, 4 * nside, degree, degree)
    test = "test/test_sphtfunc.py::TestSphtFunc::test_map2alm"
    seed = next(seeds)
    alm = complex_set(seed, degree)
    on_grid("synthesis", source("healpy", test, "alm2map"), *numbers, seed, healpy.alm2map(alm, nside, pol=False))
    if degree < 16:
        _, south, east = healpy.alm2map_der1(alm, nside)
        on_grid("gradient", source("healpy", "lib/healpy/sphtfunc.py", "alm2map_der1"), *numbers, seed, south + 1j * east)
    seed = next(seeds)
    noise = random(12 * nside * nside, seed=seed)
    geometry = ducc0.healpix.Healpix_Base(nside, "RING").sht_info()
    answer = ducc0.sht.adjoint_synthesis(map=noise[None], lmax=degree, spin=0, nthreads=1, **geometry)
    on_grid("adjoint-synthesis", source("ducc0", "python/test/test_sht.py::test_healpix_adjoint", "sht.adjoint_synthesis"), *numbers, seed, answer)
    for iterations in (0, 1, 3):
        answer = healpy.map2alm(noise, lmax=degree, iter=iterations, pol=False)
        on_grid("iterated", source("healpy", test, "map2alm"), *numbers, seed, answer, iterations=iterations)
for degree in (1, 4, 9, 15):
    seed = next(seeds)
    real = random((degree + 1) ** 2, seed=seed)
    cilm = by_degree(real, degree)
    for normalisation in ("4pi", "ortho", "schmidt"):
        for phase in (1, -1):
            theirs = pyshtools.SHCoeffs.from_array(cilm, normalization=normalisation, csphase=phase)
            named = dict(normalisation=normalisation, condon_shortley=phase == -1, degree=degree, seed=seed)
            grid = theirs.expand(grid="GLQ").to_array()[:, : 2 * degree + 1]
            snapshot.case(
                "shtools", source=source("pyshtools", "examples/python/ClassInterface/ClassExample.py", 'SHCoeffs.expand(grid="GLQ")'), rings=degree + 1,
                columns=2 * degree + 1, **some(grid), **named,
            )  # fmt: skip
            # The mean over a degree's orders, of coefficients normalised to 4π.
            snapshot.case(
                "power", source=source("pyshtools", "examples/python/GlobalSpectralAnalysis/SHRealSpectralAnalysis.py", "SHCoeffs.spectrum"),
                values=theirs.spectrum(convention="power", unit="per_lm"), **named,
            )  # fmt: skip

# At points.
for degree in (3, 10, 24, 40):
    theta, phi = angles(12)
    options = dict(lmax=degree, spin=0, loc=np.stack([theta, phi], axis=-1), epsilon=1e-14, nthreads=1)
    seed = next(seeds)
    answer = ducc0.sht.synthesis_general(alm=complex_set(seed, degree)[None], **options)[0]
    test = "python/test/test_sht.py::test_synthesis_general"
    snapshot.case("points", source=source("ducc0", test, "sht.synthesis_general"), degree=degree, seed=seed, directions=directions(theta, phi), values=answer, tolerance=1e-11)
    seed = next(seeds)
    answer = ducc0.sht.adjoint_synthesis_general(map=random(1, 12, seed=seed), **options)
    test = "python/test/test_sht.py::test_adjointness_general"
    snapshot.case("adjoint-points", source=source("ducc0", test, "sht.adjoint_synthesis_general"), degree=degree, seed=seed, directions=directions(theta, phi), **some(answer), tolerance=1e-11)
for degree in (1, 3, 8):
    at = directions(*angles(5))
    seed = next(seeds)
    _, slopes = sphericart.SphericalHarmonics(degree).compute_with_gradients(at)
    test = "python/examples/example.py"
    snapshot.case(
        "slopes", source=source("sphericart", test, "SphericalHarmonics.compute_with_gradients"), degree=degree, seed=seed, directions=at,
        values=slopes @ random((degree + 1) ** 2, seed=seed),
    )  # fmt: skip

# Spectra, beams and what they do.
for degree in (0, 1, 8, 24):
    a, b = next(seeds), next(seeds)
    for one, other in [(a, a), (a, b)]:
        answer = healpy.alm2cl(complex_set(one, degree), complex_set(other, degree))
        snapshot.case("cross-power", source=source("healpy", "test/test_sphtfunc.py::TestSphtFunc::test_alm2cl", "alm2cl"), degree=degree, seeds=[one, other], values=answer)
for degree, arc in [(0, 1.0), (16, 10.0), (32, 7.0), (64, 1.0), (64, 0.1), (128, 30.0)]:
    fwhm = np.radians(arc)
    snapshot.case(
        "beam", source=source("healpy", "test/test_sphtfunc.py::TestSphtFunc::test_gauss_beam", "gauss_beam"), degree=degree, fwhm=fwhm, values=healpy.gauss_beam(fwhm, lmax=degree)
    )
for degree in (2, 9, 20):
    seed = next(seeds)
    alm, factors = complex_set(seed, degree), 1.5 + random(degree + 1)
    named = dict(degree=degree, seed=seed)
    snapshot.case("filter", source=source("healpy", "test/test_almxfl.py", "almxfl"), factors=factors, **some(healpy.almxfl(alm, factors)), **named)
    smooth = healpy.smoothalm(alm, fwhm=np.radians(10), pol=False, inplace=False)
    test = "test/test_sphtfunc.py::TestSphtFunc::test_smoothing_notmasked"
    snapshot.case("filter", source=source("healpy", test, "smoothalm"), factors=healpy.gauss_beam(np.radians(10), lmax=degree), **some(smooth), **named)

# Rotations: the Euler angles of each library, written as the quaternion (x, y, z, w) of the rotation of the field.

def about(axis, angle):
    return np.append(np.sin(angle / 2) * np.eye(3)["xyz".index(axis)], np.cos(angle / 2))


def product(p, q):
    (a, d), (b, e) = (p[:3], p[3]), (q[:3], q[3])
    return np.append(d * b + e * a + np.cross(a, b), d * e - a @ b)


for degree in (0, 1, 3, 6, 12, 21, 33, 48):
    seed = next(seeds)
    alm = complex_set(seed, degree)
    psi, theta, phi = 2 * np.pi * random(3)
    named = dict(degree=degree, seed=seed, quaternion=product(product(about("z", phi), about("y", theta)), about("z", psi)))
    answer = ducc0.sht.rotate_alm(alm, degree, psi, theta, phi, 1)
    snapshot.case("rotation", source=source("ducc0", "python/test/test_sht.py::test_rotation", "sht.rotate_alm"), **some(answer), **named)
    answer = alm.copy()
    healpy.rotate_alm(answer, psi, theta, phi)
    snapshot.case("rotation", source=source("healpy", "test/test_sphtfunc.py::TestSphtFunc::test_rotate_alm2", "rotate_alm"), **some(answer), **named)
for degree in (1, 3, 6, 12, 21):
    seed = next(seeds)
    cilm = by_degree(random((degree + 1) ** 2, seed=seed), degree)
    l, m = degrees_and_orders(degree)
    alpha, beta, gamma = np.pi * random(3)
    for axis in "xy":
        theirs = pyshtools.SHCoeffs.from_array(cilm, normalization="ortho", csphase=1)
        theirs = theirs.rotate(alpha, beta, gamma, degrees=False, convention=axis, body=True).to_array(normalization="ortho", csphase=1)
        test = "examples/python/SHRotations/SHRotations.py"
        snapshot.case(
            "real-rotation", source=source("pyshtools", test, f'SHCoeffs.rotate(convention="{axis}")'), degree=degree, seed=seed,
            quaternion=product(product(about("z", alpha), about(axis, beta)), about("z", gamma)), **some(theirs[np.where(m < 0, 1, 0), l, np.abs(m)]),
        )  # fmt: skip

# How windows couple degrees: Σ_m of a window's power by degree, coefficients normalised to 4π; a column for each degree of the field.
for degree, width in [(4, 2), (10, 5), (16, 12)]:
    window = 1.1 + random(width + 1)
    matrix = shtools.SHMTCouplingMatrix(degree, window[:, None], taper_wt=[1.0])[: degree + 1]
    test = "examples/python/LocalizedSpectralAnalysis/SHMTCouplingMatrix.py"
    snapshot.case("coupling", source=source("pyshtools", test, "SHMTCouplingMatrix"), degree=degree, window=window, values=matrix)

assert len(snapshot.cases) >= 300, len(snapshot.cases)
snapshot.write()
