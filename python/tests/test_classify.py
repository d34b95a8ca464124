"""One picture read: names, posteriors, and where the sphere is."""

import pickle

import lobes
import numpy as np
import pytest

SIZE = 64


def sphere(material, light=3):
    """A rendered sphere that fills the array, black around it."""
    image, _ = lobes.Renderer(lobes.builtin()[light]).render(material, "sampled", size=SIZE, tolerance=1e-2)
    return np.nan_to_num(image)


@pytest.fixture(scope="module")
def training():
    return lobes.Training(lobes.builtin()[:3], cameras=2)


@pytest.fixture(scope="module")
def model(training):
    return lobes.Model(training)


def test_a_verdict_is_a_probability(model):
    whole = (SIZE / 2, SIZE / 2, SIZE / 2)
    for material in lobes.presets()[:3]:
        verdict = model.read(lobes.Picture(sphere(material)), whole)
        assert list(verdict.probabilities) == [material.name for material in lobes.presets()] == model.materials
        assert sum(verdict.probabilities.values()) + verdict.none == pytest.approx(1.0, abs=1e-12)
        best = max(verdict.probabilities, key=verdict.probabilities.get)
        assert verdict.material == (best if verdict.probabilities[best] >= verdict.none else None)
        assert verdict.posterior.shape == (len(verdict.sigmas), len(verdict.shares))
        assert verdict.posterior.sum() == pytest.approx(1.0, abs=1e-12)
        assert verdict.sigma[0] <= verdict.sigma[1] <= verdict.sigma[2]
        assert 0 <= verdict.share[0] <= verdict.share[1] <= verdict.share[2] <= 1
        assert verdict.circle == whole and verdict.saturated == 0.0 and not verdict.grey


def test_a_training_set_survives_pickling(training, model):
    again = lobes.Model(pickle.loads(pickle.dumps(training)))
    picture = lobes.Picture(sphere(lobes.presets()[4]))
    whole = (SIZE / 2, SIZE / 2, SIZE / 2)
    assert np.array_equal(again.read(picture, whole).posterior, model.read(picture, whole).posterior)


def test_the_sphere_is_found_by_its_mask(model):
    pixels = np.zeros((80, 100, 3))
    pixels[8:72, 30:94] = sphere(lobes.presets()[0])
    y, x = np.mgrid[:80, :100] + 0.5
    mask = (np.hypot(x - 62, y - 40) < 32).astype(float)
    picture = lobes.Picture(pixels, mask=mask)
    assert picture.circle() == pytest.approx((62, 40, 32), abs=0.2)
    assert model.read(picture).circle == picture.circle()
    assert np.array_equal(picture.pixels, pixels)


def test_grey_pictures_are_judged_without_colour(model):
    grey = sphere(lobes.presets()[0]).mean(axis=2, keepdims=True).repeat(3, axis=2)
    assert model.read(lobes.Picture(grey), (SIZE / 2, SIZE / 2, SIZE / 2)).grey


def test_what_cannot_be_read(model, tmp_path):
    flat = lobes.Picture(np.full((64, 64, 3), 0.5))
    with pytest.raises(ValueError, match="no sphere|sphere"):
        flat.circle()
    with pytest.raises(ValueError, match="leaves the picture"):
        model.read(flat, (32.0, 32.0, 60.0))
    with pytest.raises(ValueError, match="black"):
        model.read(lobes.Picture(np.zeros((64, 64, 3))), (32.0, 32.0, 30.0))
    with pytest.raises(ValueError, match="shape"):
        lobes.Picture(np.zeros((64, 64)))
    with pytest.raises(ValueError):
        lobes.Picture(np.full((64, 64, 3), np.nan))
    (tmp_path / "a.png").write_bytes(b"\x89PNG nonsense")
    with pytest.raises(OSError, match="a.png"):
        lobes.Picture.read(tmp_path / "a.png")
    with pytest.raises(ValueError):
        lobes.Training([])
