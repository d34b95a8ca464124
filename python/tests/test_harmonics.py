"""Transforms, rotation and values against ducc0, healpy and SciPy."""

import json
import pathlib
import pickle

import ducc0
import healpy
import lobes
import numpy as np
import pytest
import scipy.special

DEGREE = 47


def random_coefficients(count, seed=5):
    return np.random.Generator(np.random.PCG64(seed)).standard_normal(count)


@pytest.mark.parametrize("threads", [False, True])
def test_synthesis_is_that_of_ducc0(threads):
    f = random_coefficients((2, (DEGREE + 1) ** 2))
    transform = lobes.Transform("gauss-legendre", DEGREE + 1, 2 * DEGREE + 2, DEGREE)
    ours = transform.synthesise(f, threads=threads)
    for one, ours in zip(f, ours):
        theirs = ducc0.sht.synthesis_2d(
            alm=lobes.to_complex(one)[None], spin=0, lmax=DEGREE, geometry="GL", ntheta=DEGREE + 1, nphi=2 * DEGREE + 2
        )[0]
        assert np.abs(ours - theirs).max() < 1e-12 * np.abs(theirs).max()


def test_analysis_of_a_batch_in_any_layout():
    f = random_coefficients((3, 2, (DEGREE + 1) ** 2))
    transform = lobes.Transform("gauss-legendre", DEGREE + 1, 2 * DEGREE + 2, DEGREE)
    maps = transform.synthesise(f)
    assert maps.shape == (3, 2, DEGREE + 1, 2 * DEGREE + 2)
    assert np.abs(np.asarray(transform.analyse(maps)) - f).max() < 1e-12
    assert np.array_equal(transform.analyse(np.asfortranarray(maps)), transform.analyse(maps))
    assert np.array_equal(transform.analyse(maps[:, 1]), transform.analyse(maps)[:, 1])


def test_rotation_is_that_of_healpy():
    batch = random_coefficients((2, (DEGREE + 1) ** 2))
    f = batch[1]
    psi, theta, phi = 0.3, 1.1, -0.7
    theirs = lobes.to_complex(f)
    healpy.rotate_alm(theirs, psi, theta, phi)
    # healpy turns by psi about z, then theta about y, then phi about z.
    about_z = lambda a: np.array([0, 0, np.sin(a / 2), np.cos(a / 2)])
    about_y = lambda a: np.array([0, np.sin(a / 2), 0, np.cos(a / 2)])
    quaternion = product(about_z(phi), product(about_y(theta), about_z(psi)))
    ours = lobes.to_complex(lobes.Rotation(DEGREE).rotate(batch, quaternion))
    assert ours.shape == (2, len(theirs)) and np.abs(ours[1] - theirs).max() < 1e-12


def product(p, q):
    (px, py, pz, pw), (qx, qy, qz, qw) = p, q
    return np.array([
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
        pw * qw - px * qx - py * qy - pz * qz,
    ])


def test_power_is_that_of_healpy():
    f = random_coefficients((DEGREE + 1) ** 2)
    assert np.allclose(lobes.average_power(f), healpy.alm2cl(lobes.to_complex(f)), rtol=1e-13)
    assert lobes.average_power(f.reshape(1, 1, -1)).shape == (1, 1, DEGREE + 1)


def test_values_are_those_of_scipy():
    rng = np.random.Generator(np.random.PCG64(6))
    directions = rng.standard_normal((9, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    theta, phi = np.arccos(directions[:, 2]), np.arctan2(directions[:, 1], directions[:, 0])
    values = lobes.basis(directions, 12)
    f = random_coefficients(13 * 13)
    assert np.allclose(lobes.synthesise_at(f, directions), values @ f, atol=1e-12)
    index = 0
    for m in range(13):
        for part in ("real", "imag")[: 1 if m == 0 else 2]:
            for l in range(m, 13):
                theirs = scipy.special.sph_harm_y(l, m, theta, phi) * (-1) ** m * (np.sqrt(2) if m else 1)
                assert np.abs(values[:, index] - getattr(theirs, part)).max() < 1e-13, (l, m, part)
                index += 1


def test_gradients_are_differences_of_values():
    rng = np.random.Generator(np.random.PCG64(8))
    directions = rng.standard_normal((2, 3, 3))
    directions /= np.linalg.norm(directions, axis=-1)[..., None]
    f = random_coefficients((4, 13 * 13))
    values, gradients = lobes.gradients_at(f, directions)
    assert values.shape == (4, 2, 3) and gradients.shape == (4, 2, 3, 3)
    assert np.allclose(values, lobes.synthesise_at(f, directions), atol=1e-12)
    assert np.abs((gradients * directions).sum(-1)).max() < 1e-11
    tangent = np.cross(directions, [0.3, -0.5, 0.2])
    step = 1e-5
    ahead, behind = (lobes.synthesise_at(f, directions + s * step * tangent) for s in (1, -1))
    assert np.allclose((gradients * tangent).sum(-1), (ahead - behind) / (2 * step), atol=1e-6)
    basis, slopes = lobes.basis_gradients(directions, 12)
    assert basis.shape == (2, 3, 169) and slopes.shape == (2, 3, 3, 169)
    assert np.allclose(basis, lobes.basis(directions, 12), atol=1e-13)
    assert np.allclose(np.moveaxis(slopes @ f.T, -1, 0), gradients, atol=1e-10)


def test_a_transform_of_few_orders_knows_its_shape():
    # Y_30 to degree 3, of order 0 alone.
    transform = lobes.Transform("gauss-legendre", 8, 8, 3, orders=0)
    y30 = lobes.Coefficients.zeros(3, 0)
    y30.array[y30.index(3, 0)] = 1
    again = transform.analyse(transform.synthesise(y30))
    assert (again.degree, again.orders) == (3, 0)
    assert np.allclose(lobes.average_power(again), [0, 0, 0, 1 / 7], atol=1e-15)
    assert lobes.to_complex(again).shape == (10,)
    turned = lobes.Rotation(3).rotate(again, [1, 0, 0, 1])
    assert (turned.degree, turned.orders) == (3, 3)
    assert np.allclose(lobes.average_power(turned), [0, 0, 0, 1 / 7], atol=1e-15)
    # Its own transform knows what a plain array of that length is; nobody else takes it for another.
    assert np.array_equal(transform.synthesise([0, 0, 0, 1]), transform.synthesise(y30))
    with pytest.raises(ValueError, match="degree 3 and orders 0 where degree 1 and orders 1"):
        lobes.Transform("gauss-legendre", 8, 8, 1).synthesise(y30)
    with pytest.raises(ValueError, match="Coefficients where orders are left out"):
        lobes.average_power(lobes.Coefficients.zeros(3, 1).array)


def test_coefficients():
    f = lobes.Coefficients(random_coefficients((5, 2, 16)))
    assert (f.degree, f.orders, f.shape, len(f)) == (3, 3, (5, 2), 5)
    assert f[1].shape == (2,) and f[:, 0].shape == (5,) and f[..., 1].shape == (5,) and f[1, 0].shape == ()
    assert np.array_equal(f[1, 0].array, f.array[1, 0])
    with pytest.raises(IndexError):
        f[0, 0, 0]
    with pytest.raises(TypeError):
        len(f[0, 0])
    assert np.array_equal(f.get(2, -1), f.array[..., f.index(2, -1)])
    assert (f.get(9, 4) == 0).all() and f[0, 0].get(4, 0) == 0
    for l, m in [(1, 2), (-1, 0), (4, 0)]:
        with pytest.raises(IndexError):
            f.index(l, m)
    # In the order of storage every index comes once.
    for orders in range(4):
        one = lobes.Coefficients.zeros(3, orders)
        held = [(l, m) for l in range(4) for m in range(-min(l, orders), min(l, orders) + 1)]
        assert sorted(one.index(l, m) for l, m in held) == list(range(len(one.array)))
    assert f + f == 2 * f == f * 2.0 and f - f == 0 * f == -(0 * f) and (2 * f) / 2 == f
    assert isinstance(np.sqrt(f * f.array), np.ndarray)
    longer = f.with_degree(5)
    assert longer.with_degree(3) == f and longer.get(5, 5).sum() == 0 and np.allclose((longer.array**2).sum(), (f.array**2).sum())
    assert f.with_degree(1) == lobes.Coefficients(f.array[..., [f.index(0, 0), f.index(1, 0), f.index(1, 1), f.index(1, -1)]])
    for wrong in [(np.zeros(5),), (np.zeros(4), 3), (np.zeros(4), 3, 1), (np.zeros(4), None, 0), (1.0,), (np.zeros(4), -1)]:
        with pytest.raises(ValueError):
            lobes.Coefficients(*wrong)
    for wrong in [(["a"],), (np.zeros(4), 1.5), (np.zeros(4, complex),)]:
        with pytest.raises(TypeError):
            lobes.Coefficients(*wrong)


def test_zonal_convolution_and_cross_power():
    f = lobes.Coefficients(random_coefficients((3, 16)))
    factors = [2.0, 1.0, 0.5, 0.25]
    filtered = lobes.convolve_zonal(f, factors)
    assert np.allclose(lobes.average_power(filtered), lobes.average_power(f) * np.square(factors))
    assert np.allclose(lobes.cross_power(f, filtered), lobes.average_power(f) * factors)
    assert np.allclose(lobes.deconvolve_zonal(filtered, factors), f)
    floored = np.array(factors) / (np.square(factors) + 0.01)
    assert np.allclose(lobes.deconvolve_zonal(filtered, factors, 0.1), lobes.convolve_zonal(filtered, floored))
    with pytest.raises(ValueError, match="not alike"):
        lobes.cross_power(f, f[0])
    with pytest.raises(ValueError, match="factor"):
        lobes.deconvolve_zonal(f, [1, 0, 1, 1])
    assert np.allclose(lobes.recover_kernel(f[0], filtered[0])[0], factors)


def test_the_power_of_half_a_sphere():
    power = 1 / (1 + np.arange(33.0)) ** 2
    whole = lobes.Coupling(lobes.Mask(np.pi), 32)
    assert np.allclose(whole.matrix, np.eye(33), atol=1e-12) and np.allclose(whole.couple(power), power)
    half = lobes.Coupling(lobes.Mask(np.pi / 2), 32)
    edges = [0, 4, 8, 16, 33]
    bands = half.decouple(half.couple(power), edges, power)
    assert np.allclose(bands, 1, atol=1e-9)
    # The masked power of one harmonic, summed over all degrees, is what is left of its square: row sums.
    transform = lobes.Transform("gauss-legendre", 64, 128, 31)
    soft = lobes.Mask(1.0, 1.5)
    masked = soft.apply(transform, np.ones((2, 64, 128)))
    assert np.allclose(masked[1, :, 5], soft.value(transform.colatitudes))
    assert soft.value([0.5, 1.25, 2.0]) == pytest.approx([1, 0.5, 0])


def test_grids():
    f = random_coefficients(64)
    for name in ("gauss-legendre", "clenshaw-curtis", "fejer"):
        for descending in (False, True):
            transform = lobes.Transform(name, 18, 20, 7, first_azimuth=0.7, descending=descending)
            assert transform.azimuths[0] == 0.7 and (np.diff(transform.azimuths) < 0).all() == descending
            directions = transform.directions
            x, y = np.cos(transform.azimuths), np.sin(transform.azimuths)
            assert np.allclose(directions[3, :, 0], np.sin(transform.colatitudes[3]) * x)
            assert np.allclose(directions[3, :, 1], np.sin(transform.colatitudes[3]) * y)
            assert np.allclose(transform.synthesise(f), lobes.synthesise_at(f, directions), atol=1e-12)
            assert transform.weights.sum() * 20 == pytest.approx(4 * np.pi)
    # A map of the world, whose centre looks along -z.
    transform = lobes.Transform("lat-long", 32, 64, 15)
    assert np.allclose(lobes.from_harmonic(transform.directions)[15:17, 31:33].mean((0, 1)), [0, 0, -1], atol=0.01)
    assert np.array_equal(lobes.to_harmonic([0.1, 0.2, 0.3]), [0.3, 0.1, 0.2])


def test_other_conventions():
    f = lobes.Coefficients(random_coefficients((2, 16)))
    for normalisation in ("orthonormal", "four-pi", "schmidt"):
        for phase in ("plain", "condon-shortley"):
            named = {"normalisation": normalisation, "phase": phase}
            assert np.allclose(lobes.from_complex(lobes.to_complex(f, **named), **named), f, rtol=1e-14)
            for order in ("by-order", "by-degree"):
                assert np.allclose(lobes.from_real(lobes.to_real(f, **named, order=order), **named, order=order), f, rtol=1e-14)
    flat = lobes.to_real(f, normalisation="schmidt", phase="condon-shortley")
    assert np.allclose(flat[:, 4 + 2 - 1], -f.get(2, -1) * np.sqrt(5 / (4 * np.pi)))
    assert np.array_equal(lobes.to_real(f, order="by-order"), f.array)
    with pytest.raises(ValueError, match="there is no phase 'x'|there is no phase \"x\""):
        lobes.to_real(f, phase="x")


def test_complex_and_back():
    f = random_coefficients((DEGREE + 1) ** 2)
    assert np.allclose(lobes.from_complex(lobes.to_complex(f)), f, rtol=1e-15)


def test_what_a_caller_gets_wrong():
    transform = lobes.Transform("lat-long", 16, 32, 7)
    assert transform.shape == (16, 32) and transform.degree == 7
    for wrong, sentence in [
        (lambda: lobes.Transform("hexagons", 16, 32, 7), "there is no grid"),
        (lambda: lobes.Transform("lat-long", 16, 32, 90), "degree 90 is beyond"),
        (lambda: transform.analyse(np.zeros((16, 31))), "last dimensions"),
        (lambda: transform.analyse(np.full((16, 32), np.nan)), "finite"),
        (lambda: transform.analyse(np.zeros(3)), "last dimensions"),
        (lambda: lobes.average_power(np.zeros(5)), "not \\(degree \\+ 1\\)²"),
        (lambda: lobes.from_complex(np.zeros(5, complex)), "not \\(degree \\+ 1\\)\\(degree \\+ 2\\)/2"),
        (lambda: lobes.from_complex(np.zeros(0, complex)), "not \\(degree \\+ 1\\)\\(degree \\+ 2\\)/2"),
        (lambda: lobes.basis(np.zeros((2, 3)), 4), "direction"),
        (lambda: lobes.basis(np.ones((2, 3)), 10**6), "degree 1000000 is beyond"),
        (lambda: lobes.lambert(10**10), "degree 10000000000 is beyond"),
        (lambda: lobes.Rotation(3).rotate(np.zeros(16), [0, 0, 0, 0]), "quaternion"),
        (lambda: lobes.average_power(np.full(4, 1e308)), "beyond the largest double"),
        (lambda: lobes.convolve_zonal(np.full(4, 1e308), [1, 1e308]), "beyond the largest double"),
    ]:
        with pytest.raises(ValueError, match=sentence):
            wrong()
    for wrong, sentence in [
        (lambda: lobes.average_power(1.0), "single number"),
        (lambda: transform.analyse(np.zeros((16, 32), complex)), "complex128, which are not real numbers"),
        (lambda: transform.analyse([["a"] * 32] * 16), "which are not real numbers"),
        (lambda: transform.analyse(None), "object, which are not real numbers"),
        (lambda: transform.analyse(np.ma.masked_equal(np.zeros((16, 32)), 0)), "masked values"),
    ]:
        with pytest.raises(TypeError, match=sentence):
            wrong()


@pytest.mark.parametrize("dtype", ["f2", "f4", ">f4", ">f8", "i1", "u1", "<i8", ">u2", "?", "g"])
def test_real_numbers_of_any_type(dtype):
    maps = np.random.Generator(np.random.PCG64(9)).integers(0, 2, (2, 16, 32)).astype(dtype)
    transform = lobes.Transform("lat-long", 16, 32, 7)
    truth = transform.analyse(maps.astype(float))
    assert transform.analyse(maps) == truth == transform.analyse(maps.tolist())
    strided = np.zeros((2, 32, 64), dtype)[:, ::2, ::-2]
    strided[...] = maps
    assert transform.analyse(strided) == transform.analyse(np.asfortranarray(maps)) == truth
    # What does not lie at a multiple of eight bytes.
    shifted = np.frombuffer(b"x" + maps.astype(float).tobytes(), offset=1).reshape(maps.shape)
    assert transform.analyse(shifted) == truth
    for orders in ("F", "C"):
        complexes = np.asarray(lobes.to_complex(truth), "c8", order=orders)
        assert np.allclose(lobes.from_complex(complexes), truth, rtol=1e-6)
    assert np.allclose(lobes.from_complex(lobes.to_complex(truth).astype(">c16")), truth, rtol=1e-14)


@pytest.mark.parametrize("grid", [("gauss-legendre", 12, 24, 11), ("fejer", 12, 24, 11), ("clenshaw-curtis", 13, 30, 6)])
def test_adjoints_on_grids(grid):
    transform = lobes.Transform(*grid)
    rng = np.random.Generator(np.random.PCG64(3))
    sets = rng.standard_normal((5, transform.coefficient_count))
    maps = rng.standard_normal((5, *transform.shape))
    for forth, back in [(transform.synthesise, transform.synthesise_adjoint), (transform.analyse_adjoint, transform.analyse)]:
        there, here = forth(sets), back(maps)
        assert there.shape == maps.shape and here.degree == grid[3] and here.shape == (5,)
        for i in range(5):
            scale = np.linalg.norm(there[i]) * np.linalg.norm(maps[i])
            assert abs(np.vdot(there[i], maps[i]) - np.vdot(sets[i], here.array[i])) < 1e-13 * scale
        assert np.array_equal(forth(sets, threads=False), there)
    with pytest.raises(ValueError, match="last dimensions"):
        transform.synthesise_adjoint(maps[..., 1:])


def test_the_adjoint_at_points():
    rng = np.random.Generator(np.random.PCG64(4))
    directions, values, set = rng.standard_normal((50, 3)), rng.standard_normal((2, 50)), rng.standard_normal(49)
    found = lobes.synthesise_at_adjoint(values, directions, 6)
    there = lobes.synthesise_at(set, directions)
    assert found.shape == (2,) and np.allclose(values @ there, found.array @ set, rtol=1e-12)
    assert np.allclose(found.array, values @ lobes.basis(directions, 6), atol=1e-13)
    for wrong in [lambda: lobes.synthesise_at_adjoint(values[:, 1:], directions, 6), lambda: lobes.synthesise_at_adjoint(values, directions[None], 6)]:
        with pytest.raises(ValueError, match="dimensions"):
            wrong()


def test_beams_gradients_and_random_fields():
    power = 1 / np.arange(1, 26.0) ** 2
    mean = np.mean([lobes.average_power(lobes.random_field(power, seed)) for seed in range(200)], axis=0)
    # Of 200 (2l + 1) squares, within six standard errors: wrong once in 10⁷.
    assert np.all(abs(mean / power - 1) < 6 * np.sqrt(2 / (200 * (2 * np.arange(25) + 1))))
    f = lobes.random_field(power, 2**64 - 1)
    assert np.array_equal(f.with_degree(9).array, lobes.random_field(power[:10], 2**64 - 1).array)
    transform = lobes.Transform("clenshaw-curtis", 26, 50, 24)
    south, east = transform.gradient(np.stack([f.array, 2 * f.array]))
    assert south.shape == east.shape == (2, 26, 50) and np.allclose(2 * south[0], south[1])
    _, slopes = lobes.gradients_at(f, transform.directions)
    theta, phi = transform.colatitudes[:, None], transform.azimuths
    to_south = np.stack(np.broadcast_arrays(np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), -np.sin(theta)), -1)
    to_east = np.stack([-np.sin(phi), np.cos(phi), 0 * phi], -1)
    assert np.allclose((slopes * to_south).sum(-1), south[0], atol=1e-12)
    assert np.allclose((slopes * to_east).sum(-1), east[0], atol=1e-12)
    l = np.arange(25)
    assert np.allclose(lobes.laplacian(f).array, lobes.convolve_zonal(f, -l * (l + 1.0)).array)
    assert np.allclose(lobes.gaussian_beam(9, 0.3), np.exp(-(l * (l + 1))[:10] * 0.3**2 / (16 * np.log(2))))
    for wrong in [
        lambda: lobes.random_field([], 1),
        lambda: lobes.random_field([1, -1], 1),
        lambda: lobes.gaussian_beam(3, -1),
        lambda: transform.gradient(f.with_degree(23)),
        lambda: lobes.Transform("fejer", 8, 16, 3, 2).gradient(lobes.Coefficients.zeros(3, 2)),
    ]:
        with pytest.raises(ValueError):
            wrong()


def test_healpix_and_least_squares():
    transform = lobes.Transform.healpix(5, 10)
    assert transform.shape == (300,) and transform.directions.shape == (300, 3) and transform.azimuths.shape == (300,)
    assert np.isclose(np.repeat(transform.weights, [4, 8, 12, 16] + 11 * [20] + [16, 12, 8, 4]).sum(), 4 * np.pi)
    assert pickle.loads(pickle.dumps(transform)) == transform != lobes.Transform.healpix(5, 9)
    f = lobes.random_field(np.ones(11), 4)
    map = transform.synthesise(f)
    assert np.allclose(map, lobes.synthesise_at(f, transform.directions), atol=1e-12)
    found, residual, steps, condition = transform.analyse_least_squares(map, 1e-13)
    assert np.allclose(found, f, atol=1e-11) and residual < 1e-12 and steps < 20 and 1 < condition < 1.2
    errors = [np.linalg.norm(transform.analyse_iterated(map, i).array - f.array) for i in (0, 3)]
    assert errors[1] < 1e-2 * errors[0]
    both = transform.analyse_iterated(np.stack([map, 2 * map]))
    assert both.shape == (2,) and np.allclose(2 * both.array[0], both.array[1])
    cut = lobes.Mask(1.0).apply(transform, map)
    assert np.array_equal(cut != 0, transform.directions[:, 2] > np.cos(1.0))
    at, residual, _, _ = lobes.analyse_at(map[:200], transform.directions[:200], 3)
    matrix = lobes.basis(transform.directions[:200], 3)
    truth, squares, _, singular = np.linalg.lstsq(matrix, map[:200], rcond=None)
    assert np.allclose(at, truth, atol=1e-9) and np.isclose(residual, np.sqrt(squares[0] / 200))
    for wrong in [
        lambda: lobes.Transform.healpix(0, 1),
        lambda: lobes.Transform.healpix(2, 7),
        lambda: lobes.Transform("healpix", 7, 9, 2),
        lambda: transform.analyse_least_squares(map, 0),
        lambda: transform.analyse_least_squares(np.stack([map, map])),
        lambda: lobes.analyse_at(map, transform.directions[:9], 3),
    ]:
        with pytest.raises(ValueError):
            wrong()


def test_masks_of_any_shape():
    transform = lobes.Transform.healpix(16, 32)
    ragged = 1.0 * ((abs(transform.directions[:, 2]) > 0.2) & (transform.directions @ [0.6, 0.48, 0.64] < 0.98))
    for kind, rise in [("c1", lambda x: x - np.sin(2 * np.pi * x) / (2 * np.pi)), ("c2", lambda x: 0.5 - 0.5 * np.cos(np.pi * x))]:
        soft = lobes.apodise(transform, ragged, 0.3, kind)
        nearest = (1 - transform.directions @ transform.directions[ragged == 0].T).min(axis=1)
        x = np.sqrt(np.clip(nearest / (1 - np.cos(0.3)), 0, 1))
        assert np.allclose(soft, ragged * rise(x), atol=1e-6)
    found = transform.analyse_least_squares(soft)[0]
    coupling = lobes.Coupling.from_power(lobes.average_power(found), 16)
    assert coupling.mask is None and np.array_equal(pickle.loads(pickle.dumps(coupling)).matrix, coupling.matrix)
    power, edges = 1 / np.arange(1, 18.0), [0, 5, 11, 17]
    bands = coupling.decouple(coupling.couple(power), edges, weights=np.ones(17))
    assert np.allclose(bands, coupling.windows(edges, weights=np.ones(17)) @ power)
    assert np.allclose(coupling.decouple(coupling.couple(power), edges, power), 1)
    for wrong in [
        lambda: lobes.apodise(transform, ragged, 0),
        lambda: lobes.apodise(transform, ragged, 0.1, "c3"),
        lambda: lobes.Coupling.from_power([], 3),
        lambda: coupling.windows(edges, np.ones(3)),
        lambda: coupling.decouple(power, edges, None, -power),
    ]:
        with pytest.raises(ValueError):
            wrong()


def test_wigner_matrices():
    quaternion = np.array([0.3, 0.5, -0.2, 0.8])
    for degree in (0, 1, 4):
        side = 2 * degree + 1
        assert np.allclose(lobes.wigner_d(degree, 0.7) @ lobes.wigner_d(degree, 0.4), lobes.wigner_d(degree, 1.1), atol=1e-14)
        large = lobes.wigner_rotation(degree, quaternion)
        assert large.shape == (side, side) and np.allclose(large @ large.conj().T, np.eye(side), atol=1e-14)
        turn = lobes.wigner_rotation_real(degree, quaternion)
        for column in range(side):
            one = lobes.Coefficients.zeros(degree)
            one.array[one.index(degree, column - degree)] = 1
            turned = lobes.Rotation(degree).rotate(one, quaternion)
            assert np.allclose([turned.get(degree, m) for m in range(-degree, degree + 1)], turn[:, column], atol=1e-14)
    for wrong in [lambda: lobes.wigner_d(513, 0.1), lambda: lobes.wigner_d(2, np.nan), lambda: lobes.wigner_rotation(2, [0, 0, 0, 0])]:
        with pytest.raises(ValueError):
            wrong()


def test_sums_at_many_directions_are_those_of_ducc0():
    degree, rng = 150, np.random.Generator(np.random.PCG64(9))
    f = np.stack([random_coefficients((degree + 1) ** 2, seed) for seed in (1, 2)])
    directions = rng.standard_normal((5000, 3))
    directions[:2] = [[0, 0, 1], [0, 0, -1]]
    angles = np.stack([np.arctan2(np.hypot(*directions.T[:2]), directions[:, 2]), np.arctan2(*directions.T[1::-1]) % (2 * np.pi)], 1)
    theirs = [ducc0.sht.synthesis_general(alm=lobes.to_complex(one)[None], spin=0, lmax=degree, loc=angles, epsilon=1e-12)[0] for one in f]
    for tolerance in (1e-4, 1e-11):
        found = lobes.synthesise_at(f, directions.reshape(50, 100, 3), tolerance=tolerance)
        assert found.shape == (2, 50, 100)
        assert np.std(found.reshape(2, -1) - theirs) < tolerance * np.std(theirs)
        y = rng.standard_normal(5000)
        back = lobes.synthesise_at_adjoint(y, directions, degree, tolerance=tolerance, threads=False)
        assert np.isclose(np.vdot(f[0], back), np.vdot(found[0].ravel(), y), rtol=0, atol=1e-13 * np.linalg.norm(found[0]) * np.linalg.norm(y))
    for wrong in [lambda: lobes.synthesise_at(f, directions, tolerance=0), lambda: lobes.synthesise_at_adjoint(y, directions, degree, tolerance=1)]:
        with pytest.raises(ValueError, match="tolerance"):
            wrong()


def test_splats_are_rotated_as_their_test_vectors_say():
    vectors = json.loads((pathlib.Path(__file__).parents[2] / "oracles" / "snapshots" / "splat.json").read_text())["cases"]
    for case in vectors:
        set, turn, want = (np.array(case[key]) for key in ("coefficients", "quaternion", "rotated"))
        assert np.allclose(lobes.rotate_splats(set, turn, case["basis"]), want, rtol=0, atol=4e-15)
        assert np.allclose(lobes.rotate_splats(set.astype("f4"), turn, case["basis"]), want, rtol=0, atol=3e-7)


def test_splats_of_any_layout():
    rng = np.random.Generator(np.random.PCG64(8))
    turns = rng.standard_normal((40, 4))
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    files = rng.standard_normal((40, 3, 16)).astype(np.float32)
    want = lobes.rotate_splats(files, turns)
    assert want.dtype == np.float32 and want.shape == files.shape
    assert lobes.rotate_splats(files.tolist(), turns).dtype == np.float64
    # Strided views are read as they are meant; the input stays as it was.
    before = files.copy()
    tensors = files.transpose(0, 2, 1)
    assert np.array_equal(lobes.rotate_splats(tensors, turns, axis=1), want.transpose(0, 2, 1))
    assert np.array_equal(lobes.rotate_splats(tensors[:, 1:], turns, axis=-2, threads=False), want.transpose(0, 2, 1)[:, 1:])
    assert np.array_equal(lobes.rotate_splats(files[::-2], turns[::-2]), want[::-2])
    assert np.array_equal(lobes.rotate_splats(files[..., ::-1][..., ::-1], turns), want)
    assert np.array_equal(files, before)
    one = lobes.rotate_splats(files, turns[3])
    assert np.array_equal(one[3], want[3]) and not np.array_equal(one[4], want[4])
    assert lobes.rotate_splats(np.zeros((0, 16)), turns[0]).shape == (0, 16)
    for wrong, sentence in [
        (lambda: lobes.rotate_splats(files[..., :14], turns), "along axis -1"),
        (lambda: lobes.rotate_splats(files, turns, axis=3), "no axis 3"),
        (lambda: lobes.rotate_splats(files, turns[:39]), "first axes"),
        (lambda: lobes.rotate_splats(files, 2 * turns), "at index 0 has the length"),
        (lambda: lobes.rotate_splats(np.full(16, np.nan), turns[0]), "finite"),
        (lambda: lobes.rotate_splats(files, turns, "opengl"), "3dgs, gltf, e3nn, lobes"),
    ]:
        with pytest.raises(ValueError, match=sentence):
            wrong()


def test_complex_fields_are_scipys():
    degree, transform = 7, lobes.Transform("gauss-legendre", 9, 17, 7)
    rng = np.random.Generator(np.random.PCG64(6))
    a = rng.standard_normal(64) + 1j * rng.standard_normal(64)
    theta, phi = transform.colatitudes[:, None], transform.azimuths
    theirs = sum(a[l * l + l + m] * scipy.special.sph_harm_y(l, m, theta, phi) for l in range(degree + 1) for m in range(-l, l + 1))
    ours = transform.synthesise_complex(a)
    assert np.allclose(ours, theirs, atol=1e-12) and np.allclose(transform.analyse_complex(ours), a, atol=1e-13)
    turn = [0.3, 0.5, -0.2, 0.8]
    turned = lobes.Rotation(degree).rotate_complex(a, turn)
    for l in range(degree + 1):
        assert np.allclose(turned[l * l : (l + 1) ** 2], lobes.wigner_rotation(l, turn) @ a[l * l : (l + 1) ** 2], atol=1e-13)
    for wrong in [lambda: transform.synthesise_complex(a[1:]), lambda: transform.analyse_complex(ours[None]), lambda: transform.synthesise_complex(a[None])]:
        with pytest.raises(ValueError):
            wrong()


def test_single_precision_is_double_rounded():
    double, single = (kind("gauss-legendre", 64, 128, 63) for kind in (lobes.Transform, lobes.SingleTransform))
    sets = np.random.default_rng(5).normal(size=(2, 4096)).astype(np.float32)
    for name, values in [
        ("synthesise", sets),
        ("analyse", double.synthesise(sets).astype(np.float32)),
        ("synthesise_adjoint", double.synthesise(sets).astype(np.float32)),
        ("analyse_adjoint", sets),
    ]:
        want, got = np.asarray(getattr(double, name)(values)), getattr(single, name)(values)
        assert got.dtype == np.float32 and got.shape == want.shape
        assert np.sqrt(np.mean((got - want) ** 2)) < 1e-6 * np.std(want)
        assert np.array_equal(getattr(single, name)(values, threads=False), got)
    assert single.shape == (64, 128) and single.coefficient_count == 4096
    with pytest.raises(ValueError, match="lengths of their own has no transform in single precision"):
        lobes.SingleTransform("healpix", 7, 8, 2)
    with pytest.raises(ValueError, match="index 7"):
        single.synthesise(np.where(np.arange(4096) == 7, np.nan, sets[0]))
