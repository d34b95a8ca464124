"""One picture read: names, posteriors, and where the sphere is."""

import pickle

import lobes
import numpy as np
import pytest

SIZE = 64


def sphere(material, light=3):
    """A rendered sphere that fills the array, black around it."""
    return lobes.Renderer(lobes.builtin()[light]).render(material, size=SIZE, tolerance=1e-2).pixels


@pytest.fixture(scope="module")
def training():
    steps = []
    training = lobes.Training(lobes.builtin()[:3], cameras=2, progress=lambda done, total: steps.append((done, total)))
    assert steps[-1] == (6, 6) and all(before < after for before, after in zip(steps, steps[1:]))
    return training


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
    verdict = model.read(picture, whole)
    assert again.read(picture, whole) == verdict == pickle.loads(pickle.dumps(verdict))
    assert verdict != model.read(lobes.Picture(sphere(lobes.presets()[2])), whole)


def test_a_rendering_is_a_picture(model):
    rendering = lobes.Renderer(lobes.builtin()[3]).render(lobes.presets()[4], size=SIZE, tolerance=1e-2)
    picture = lobes.Picture(rendering)
    assert np.array_equal(picture.mask, rendering.mask)
    assert picture.circle() == pytest.approx((SIZE / 2,) * 3, abs=0.2)
    # NaN does not matter where the mask is 0, and elsewhere it is refused.
    holes = np.where(rendering.mask[..., None], rendering.pixels, np.nan)
    assert lobes.Picture(holes, mask=rendering.mask) == picture
    with pytest.raises(ValueError, match="NaN"):
        lobes.Picture(holes)


def test_codes_are_known_by_their_type():
    codes = np.random.Generator(np.random.PCG64(12)).integers(0, 256, (8, 9, 3), np.uint8)
    picture = lobes.Picture(codes)
    assert picture.encoded and np.array_equal(picture.pixels, lobes.linear_of_srgb(codes))
    assert lobes.Picture(codes / 255, encoded=True) == picture == lobes.Picture((codes * np.uint16(257)))
    linear = lobes.Picture(codes, encoded=False)
    assert not linear.encoded and np.array_equal(linear.pixels, codes)
    c = codes[0, 0, 0] / 255
    assert picture.pixels[0, 0, 0] == pytest.approx(c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4)
    assert np.allclose(lobes.srgb_of_linear(picture.pixels), codes / 255)
    with pytest.raises(ValueError, match="fractions"):
        lobes.Picture(codes.astype(float), encoded=True)


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
    with pytest.raises(ValueError, match=r"sphere.*circle=\(x, y, radius\)"):
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
    with pytest.raises(ValueError, match="mask has the shape"):
        lobes.Picture(np.ones((8, 8, 3)), mask=np.ones(64))
    with pytest.raises(ValueError, match="not in \\[0, 1\\]"):
        lobes.Picture(np.ones((8, 8, 3)), mask=np.full((8, 8), 2.0))


def test_the_finish_of_a_ball():
    reader = lobes.FinishReader()
    renderer = lobes.Renderer(lobes.builtin()[10])
    for material, finish in [(lobes.presets()[0], "matte"), (lobes.presets()[7], "smooth metal")]:
        picture = lobes.Picture(renderer.render(material, size=SIZE, tolerance=1e-2))
        verdict = reader.read(picture)
        assert verdict.finish == finish
        assert sum(verdict.finishes.values()) + verdict.no_single_finish == pytest.approx(1.0, abs=1e-9)
        for low, middle, high in [verdict.sigma, verdict.share, *verdict.base_colour]:
            assert low <= middle <= high
        assert (verdict.metallic > 0.5) == (finish == "smooth metal")
        assert verdict.usable > 0.9 and 0.0 <= verdict.prints <= 1.0 - verdict.usable + 1e-12
        assert verdict == pickle.loads(pickle.dumps(verdict)) == reader.read(picture, verdict.circle)
    with pytest.raises(ValueError, match="leaves the picture"):
        reader.read(picture, (SIZE, SIZE, SIZE))


def test_the_light_about_a_ball():
    light = lobes.builtin()[10]
    picture = lobes.Picture(lobes.Renderer(light).render(lobes.presets()[7], size=SIZE, tolerance=1e-2))
    mean, deviation = lobes.FinishReader().light(picture, rows=32)
    assert mean.shape == deviation.shape == (32, 64, 3)
    assert np.all(deviation >= 0)
    # The ball mirrors nearly all round, to a factor that its base colour leaves open.
    truth = light.resampled(32).pixels
    assert deviation[16, 32, 1] > deviation[16, 0, 1]
    for channel in range(3):
        found, expected = np.cbrt(mean[..., channel].ravel()), np.cbrt(truth[..., channel].ravel())
        assert np.corrcoef(found, expected)[0, 1] > 0.6
    for wrong in (0, 1, 1025):
        with pytest.raises(ValueError, match="rows"):
            lobes.FinishReader().light(picture, rows=wrong)


def test_a_mirror_ball_is_unwrapped():
    light = lobes.builtin()[3]
    mirror = lobes.Material.from_albedos("mirror", [0.0] * 3, [0.5] * 3, 0.0)
    rendering = lobes.Renderer(light).render(mirror, size=256, tolerance=1e-2, pixel_samples=4)
    picture = lobes.Picture(rendering.pixels)
    pixels, alpha = lobes.probe([picture], [1.0], (128.0, 128.0, 128.0), reflectance=[0.5] * 3, rows=32)
    assert pixels.shape == (32, 64, 3) and alpha.shape == (32, 64)
    truth = light.resampled(32).pixels
    seen = alpha > 0.9
    assert seen.mean() > 0.8
    assert np.median(np.abs(pixels[seen] / truth[seen] - 1)) < 0.1
    with pytest.raises(ValueError, match="rows"):
        lobes.probe([picture], rows=1)
    with pytest.raises(ValueError, match="exposures"):
        lobes.probe([picture], [1.0, 2.0])
    with pytest.raises(ValueError, match="photograph"):
        lobes.probe([])


def test_an_estimate_of_light_is_judged():
    truth = lobes.builtin()[3].resampled(64)
    errors = lobes.evaluate(truth, truth, size=32)
    assert set(errors["light"]) == {"peak-direction", "sun-direction", "irradiance", "exposure"}
    assert len(errors) == 4 and all(abs(value) < 1e-5 for ball in errors.values() for value in ball.values())
    darker = lobes.EnvironmentMap(0.5 * truth.pixels)
    assert lobes.evaluate(truth, darker, size=32)["light"]["exposure"] == pytest.approx(-1, abs=1e-9)
    with pytest.raises(ValueError, match="by"):
        lobes.evaluate(truth, truth.resampled(32))
    with pytest.raises(ValueError, match="stylelight"):
        lobes.evaluate(truth, truth, preset="nothing")
    with pytest.raises(ValueError, match="size"):
        lobes.evaluate(truth, truth, size=0)
