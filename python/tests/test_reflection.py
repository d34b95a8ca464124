"""Lobes, rendering and features against closed forms and plain NumPy."""

import lobes
import numpy as np
import pytest


def test_ward_is_its_formula():
    sigma, view = 0.2, np.array([0.3, 0.1, 0.0])
    view[2] = np.sqrt(1 - view @ view)
    rng = np.random.Generator(np.random.PCG64(7))
    lights = rng.standard_normal((50, 3))
    lights /= np.linalg.norm(lights, axis=1)[:, None]
    lights[:, 2] = np.abs(lights[:, 2])
    half = lights + view
    tan2 = (half[:, 0] ** 2 + half[:, 1] ** 2) / half[:, 2] ** 2
    theirs = np.exp(-tan2 / sigma**2) / (4 * np.pi * sigma**2) * np.sqrt(lights[:, 2] / view[2])
    assert np.allclose(lobes.Lobe("ward1992", sigma).evaluate(view, lights), theirs, rtol=1e-12)


def test_albedo_and_zonal_coefficients_agree():
    lobe = lobes.Lobe("gmd", 0.1)
    closed = 1 - 0.01 * (1 - np.exp(-100))
    assert abs(lobe.albedo(1.0) - closed) < 1e-13
    assert abs(lobe.zonal(1.0, 8)[0] - closed) < 1e-12
    assert np.allclose(lobes.lambert(4) / np.pi, [1, 2 / 3, 1 / 4, 0, -1 / 24], atol=1e-15)


def test_a_white_sphere_in_white_light_is_white():
    light = lobes.EnvironmentMap(np.ones((32, 64, 3)))
    image, error = lobes.Renderer(light).render(lobes.Material.from_albedos("white", [1] * 3, [0] * 3, 0.0), size=32)
    inside = ~np.isnan(image[..., 0])
    assert image.shape == (32, 32, 3) and 0.7 < inside.mean() < 0.8
    assert np.abs(image[inside] - 1).max() < 1e-3 and error < 1e-3


def test_threads_do_not_change_a_byte():
    renderer = lobes.Renderer(lobes.builtin()[0])
    one, two = (renderer.render(lobes.presets()[0], size=24, threads=threads)[0] for threads in (False, True))
    assert one.tobytes() == two.tobytes()


def test_brightness_changes_colour_alone():
    renderer = lobes.Renderer(lobes.builtin()[2])
    image, _ = renderer.render(lobes.Material.metal("metal", [0.8] * 3, 0.9, 0.1), size=64, camera=lobes.Camera().rolled(0.3))
    before, after = lobes.features(image), lobes.features(3 * image)
    assert len(before) == len(lobes.FEATURE_NAMES)
    assert np.allclose(after[:7], before[:7], rtol=1e-9)
    assert np.allclose(after[7:], 9 * before[7:], rtol=1e-12)


def test_what_a_caller_gets_wrong(tmp_path):
    light = lobes.builtin()[0]
    metal = lobes.presets()[0]
    for wrong, sentence in [
        (lambda: lobes.Lobe("phong", 0.1), "phong"),
        (lambda: lobes.Lobe("duer", -1.0), "is not"),
        (lambda: lobes.Lobe("duer", float("nan")), "is not"),
        (lambda: lobes.Camera(distance=0.5), "outside the sphere"),
        (lambda: lobes.EnvironmentMap(np.zeros((4, 8, 3))), "above zero"),
        (lambda: lobes.EnvironmentMap(np.zeros((4, 8))), "rows, columns, 3"),
        (lambda: lobes.Renderer(light).render(metal, tolerance=-1.0), "tolerance"),
        (lambda: lobes.features(np.zeros((4, 5, 3))), "size, size, 3"),
        (lambda: lobes.Material.from_albedos("m", [0.9] * 3, [0.9] * 3, 0.1), "at most 1"),
    ]:
        with pytest.raises(ValueError, match=sentence):
            wrong()
    with pytest.raises(OSError, match="cannot be read"):
        lobes.EnvironmentMap.read(tmp_path / "none.exr")
