"""Transforms, rotation and values against ducc0, healpy and SciPy."""

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
    assert np.abs(transform.analyse(maps) - f).max() < 1e-12
    assert np.array_equal(transform.analyse(np.asfortranarray(maps)), transform.analyse(maps))
    assert np.array_equal(transform.analyse(maps[:, 1]), transform.analyse(maps)[:, 1])


def test_rotation_is_that_of_healpy():
    f = random_coefficients((DEGREE + 1) ** 2)
    psi, theta, phi = 0.3, 1.1, -0.7
    theirs = lobes.to_complex(f)
    healpy.rotate_alm(theirs, psi, theta, phi)
    # healpy turns by psi about z, then theta about y, then phi about z.
    about_z = lambda a: np.array([0, 0, np.sin(a / 2), np.cos(a / 2)])
    about_y = lambda a: np.array([0, np.sin(a / 2), 0, np.cos(a / 2)])
    quaternion = product(about_z(phi), product(about_y(theta), about_z(psi)))
    ours = lobes.to_complex(lobes.Rotation(DEGREE).rotate(f, quaternion))
    assert np.abs(ours - theirs).max() < 1e-12


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


def test_complex_and_back():
    f = random_coefficients((DEGREE + 1) ** 2)
    assert np.allclose(lobes.from_complex(lobes.to_complex(f)), f, rtol=1e-15)


def test_what_a_caller_gets_wrong():
    transform = lobes.Transform("lat-long", 16, 32, 7)
    assert transform.shape == (16, 32) and transform.degree == 7
    for wrong, sentence in [
        (lambda: lobes.Transform("healpix", 16, 32, 7), "there is no grid"),
        (lambda: lobes.Transform("lat-long", 16, 32, 90), "degree 90 is beyond"),
        (lambda: transform.analyse(np.zeros((16, 31))), "last dimensions"),
        (lambda: transform.analyse(np.full((16, 32), np.nan)), "finite"),
        (lambda: transform.analyse(np.zeros(3)), "last dimensions"),
        (lambda: lobes.average_power(np.zeros(5)), "not \\(degree \\+ 1\\)²"),
        (lambda: lobes.average_power(np.array(1.0)), "at least an array"),
        (lambda: lobes.from_complex(np.zeros(5, complex)), "needed"),
        (lambda: lobes.from_complex(np.zeros(0, complex)), "needed"),
        (lambda: lobes.basis(np.zeros((2, 3)), 4), "direction"),
        (lambda: lobes.Rotation(3).rotate(np.zeros(16), [0, 0, 0, 0]), "quaternion"),
    ]:
        with pytest.raises(ValueError, match=sentence):
            wrong()
    with pytest.raises(TypeError):
        transform.analyse(np.zeros((16, 32), np.float32))
