"""What is data can be compared, copied, pickled and printed."""

import copy
import importlib.metadata
import pickle

import lobes
import numpy as np
import pytest

RNG = np.random.Generator(np.random.PCG64(3))
MAP = lobes.EnvironmentMap(RNG.random((32, 64, 3)), "a map")
RENDERING = lobes.Renderer(MAP).render(lobes.presets()[1], size=12, tolerance=1e-2)
LIGHTS = np.array([[np.sin(a), 0, np.cos(a)] for a in np.linspace(-1, 1, 40)])
VIEWS = np.tile([0.0, 0.0, 1.0], (40, 1))
VALUES = 0.1 + lobes.Lobe("duer", 0.2).evaluate(VIEWS[0], LIGHTS) / LIGHTS[:, 2]

DATA = [
    (lobes.Coefficients(RNG.random((2, 16))), lobes.Coefficients(np.zeros((2, 16)))),
    (lobes.Coefficients(RNG.random(4), 3, 0), lobes.Coefficients(RNG.random(4))),
    (lobes.Transform("fejer", 8, 16, 5, 3, first_azimuth=0.1, descending=True), lobes.Transform("fejer", 8, 16, 5, 3)),
    (lobes.Transform("lat-long", 8, 16, 5), lobes.Transform("lat-long", 8, 16, 4)),
    (lobes.Mask(1.0), lobes.Mask(1.0, 1.5)),
    (lobes.Lobe("gmd", 0.1, 0.2), lobes.Lobe("gmd", 0.1)),
    (lobes.Material.metal("é", [0.1, 0.2, 1 / 3], 0.9, 0.1), lobes.Material.metal("e", [0.1, 0.2, 1 / 3], 0.9, 0.1)),
    (lobes.presets()[0], lobes.presets()[1]),
    (lobes.GgxMaterial("a", 0.2, [0.5] * 3, f0=[0.04] * 3), lobes.GgxMaterial("a", 0.2, [0.5] * 3, index=[1.5] * 3)),
    (lobes.GgxMaterial("b", 0.0, index=[0.2, 0.4, 1.5], extinction=[3.1, 2.7, 1.9]), lobes.GgxMaterial("b", 0.1, f0=[0.5] * 3)),
    (lobes.GgxMaterial("c", (0.1, 0.2), f0=[0.5] * 3, axis=[0.0, 0.6, 0.8]), lobes.GgxMaterial("c", (0.1, 0.2), f0=[0.5] * 3)),
    (lobes.Camera([1, 2, 3], distance=4.0).rolled(0.1), lobes.Camera([1, 2, 3], distance=4.0)),
    (MAP, lobes.EnvironmentMap(MAP.pixels, "another")),
    (MAP.spectrum(15), MAP.spectrum(14)),
    (MAP.spectrum(15).law, MAP.spectrum(14).law),
    (RENDERING, lobes.Renderer(MAP).render(lobes.presets()[2], size=12, tolerance=1e-2)),
    (lobes.Picture(RENDERING), lobes.Picture(RENDERING.pixels)),
    (lobes.Picture(RNG.integers(0, 255, (9, 8, 3), np.uint8), focal_length=20.0), lobes.Picture(RNG.random((9, 8, 3)))),
    (lobes.fit_lobe(LIGHTS, VIEWS, VALUES, variant="gmd"), lobes.fit_lobe(LIGHTS, VIEWS, VALUES, variant="duer")),
]


@pytest.mark.parametrize("one, other", DATA, ids=[type(one).__name__ for one, _ in DATA])
def test_data(one, other):
    for again in (pickle.loads(pickle.dumps(one)), copy.copy(one), copy.deepcopy(one)):
        assert again == one and not again != one
        if type(one).__hash__ is not None:
            assert hash(again) == hash(one)
    assert one != other and one != 1 and not one == "text"
    assert type(one).__name__ in repr(one) and "object at" not in repr(one)


def test_arrays_of_data_are_copied():
    one = lobes.Coefficients(np.ones(4))
    other, deep = copy.copy(one), copy.deepcopy(one)
    other.array[0] = deep.array[0] = 2
    assert one.array[0] == 1
    with pytest.raises(TypeError, match="unhashable"):
        hash(one)
    MAP.pixels[:] = 0
    assert MAP.pixels.max() > 0


def test_plans_print_themselves():
    for plan in (lobes.Rotation(3), lobes.Renderer(MAP), lobes.LightTree(MAP), lobes.Coupling(lobes.Mask(1.0), 4), RENDERING.camera):
        assert "object at" not in repr(plan)
    assert repr(pickle.loads(pickle.dumps(lobes.Rotation(3)))) == "Rotation(3)"
    assert pickle.loads(pickle.dumps(lobes.Coupling(lobes.Mask(1.0), 4))).degree == 4
    assert repr(lobes.Mask(1.0, 1.5)) == "Mask(1.0, 1.5)" and eval(f"lobes.{RENDERING.camera!r}") == RENDERING.camera


def test_the_version_is_that_of_the_package():
    assert lobes.__version__ == importlib.metadata.version("lobes")


def test_spectra():
    spectrum = lobes.builtin()[0].spectrum()
    assert len(spectrum.luminance) == 129 and spectrum.channels.shape == (3, 129)
    light = lobes.builtin()[0].coefficients(128)
    assert light.shape == (3,)
    assert np.allclose(lobes.average_power(light), spectrum.channels, rtol=1e-9)
    assert lobes.fit_power_law(spectrum.luminance, 2, 64) == spectrum.law
    slope = np.polyfit(np.log(np.arange(2, 65)), np.log(spectrum.luminance[2:65]), 1)[0]
    assert spectrum.law.eta == pytest.approx(-slope - 2, rel=1e-9)
