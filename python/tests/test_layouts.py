"""Arrays of any real type and layout are read as they mean, or refused with a sentence: never copied wrongly, and never written to."""

import dataclasses

import lobes
import numpy as np
import pytest
from test_arguments import GOOD

RNG = np.random.Generator(np.random.PCG64(11))


def exact(array):
    """Doubles that are also singles."""
    return np.asarray(array).astype("float32").astype(float)


def unit(*shape):
    vectors = RNG.standard_normal((*shape, 3))
    vectors[..., 2] = np.abs(vectors[..., 2])
    return exact(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


TRANSFORM = lobes.Transform("gauss-legendre", 8, 16, 3)
SINGLE = lobes.SingleTransform("gauss-legendre", 8, 16, 3)
HEALPIX = lobes.Transform.healpix(2, 3)
MAPS = exact(RNG.random((2, 8, 16)))
SETS = exact(RNG.random((2, 3, 16)))
COMPLEX_SET = RNG.integers(-9, 9, 16) + 1j * RNG.integers(-9, 9, 16)
# Degree 1, m ≥ 0: those of m = 0, the first two, are real.
HALF_SETS = COMPLEX_SET[:15].reshape(5, 3) - 1j * (COMPLEX_SET.imag[:15].reshape(5, 3) * [1, 1, 0])
COMPLEX_MAP = RNG.integers(-9, 9, (8, 16)) + 1j * RNG.integers(-9, 9, (8, 16))
POWER = exact(1 / np.arange(1, 6.0))
SHAPE, WEIGHTS = exact(POWER[::-1] + 1), exact(POWER + 1)
MASKS = (RNG.random((2, 8, 16)) < 0.7).astype(float)
PIXELS = exact(RNG.random((6, 12, 3)))
LIGHT = lobes.EnvironmentMap(exact(RNG.random((16, 32, 3))))
PICTURE = exact(0.1 + 0.8 * RNG.random((40, 40, 3)))
LOBE = lobes.Lobe("gmd", 0.3)
LIGHTS, VIEWS = unit(40), unit(40)
BRDF = exact(0.1 + np.array([LOBE.evaluate(view, light) / light[2] for view, light in zip(VIEWS, LIGHTS)]))
SPECTRUM = lobes.Coupling(lobes.Mask(2.5), 4)
OPERATOR = lobes.Operator(0.1, 4, 3, threads=False)
MATERIAL = lobes.presets()[4]
QUATERNION = np.array([0.25, -0.5, 0.125, 0.75])
CIRCLE = np.array([20.0, 20.0, 18.5])
ANGLES = exact(np.linspace(0.1, 1.2, 4))
READER = lobes.FinishReader()
BALL = lobes.Picture(lobes.Renderer(lobes.builtin()[5].resampled(32)).render(lobes.presets()[7], size=48))

# What takes arrays, with arrays that no wrong order of their values leaves as they are.
CALLS = {
    "Transform.analyse": (TRANSFORM.analyse, [MAPS]),
    "Transform.synthesise": (TRANSFORM.synthesise, [SETS]),
    "Transform.synthesise_adjoint": (TRANSFORM.synthesise_adjoint, [MAPS]),
    "Transform.analyse_adjoint": (TRANSFORM.analyse_adjoint, [SETS]),
    "Transform.analyse_least_squares": (HEALPIX.analyse_least_squares, [exact(RNG.random(48))]),
    "Transform.analyse_iterated": (HEALPIX.analyse_iterated, [exact(RNG.random((2, 48)))]),
    "Transform.gradient": (TRANSFORM.gradient, [SETS]),
    "Transform.synthesise_complex": (TRANSFORM.synthesise_complex, [COMPLEX_SET]),
    "Transform.analyse_complex": (TRANSFORM.analyse_complex, [COMPLEX_MAP]),
    "SingleTransform.analyse": (SINGLE.analyse, [MAPS]),
    "SingleTransform.synthesise": (SINGLE.synthesise, [SETS]),
    "SingleTransform.synthesise_adjoint": (SINGLE.synthesise_adjoint, [MAPS]),
    "SingleTransform.analyse_adjoint": (SINGLE.analyse_adjoint, [SETS]),
    "Rotation.rotate": (lobes.Rotation(3).rotate, [SETS, QUATERNION]),
    "Rotation.rotate_complex": (lobes.Rotation(3).rotate_complex, [COMPLEX_SET, QUATERNION]),
    # Half a turn about the pole changes signs alone, so that single precision rounds nothing.
    "rotate_splats": (lobes.rotate_splats, [exact(RNG.random((5, 16))), np.array([0.0, 0.0, 1.0, 0.0])]),
    "Coefficients": (lobes.Coefficients, [SETS]),
    "basis": (lambda directions: lobes.basis(directions, 3), [unit(4, 5)]),
    "basis_gradients": (lambda directions: lobes.basis_gradients(directions, 3), [unit(4, 5)]),
    "synthesise_at": (lobes.synthesise_at, [SETS, unit(4, 5)]),
    "synthesise_at_adjoint": (lambda values, at: lobes.synthesise_at_adjoint(values, at, 3), [exact(RNG.random((2, 5))), unit(5)]),
    "analyse_at": (lambda values, at: lobes.analyse_at(values, at, 2), [exact(RNG.random(60)), unit(60)]),
    "wigner_rotation": (lambda quaternion: lobes.wigner_rotation(2, quaternion), [QUATERNION]),
    "wigner_rotation_real": (lambda quaternion: lobes.wigner_rotation_real(2, quaternion), [QUATERNION]),
    "gradients_at": (lobes.gradients_at, [SETS, unit(4, 5)]),
    "to_harmonic": (lobes.to_harmonic, [unit(4, 5)]),
    "from_harmonic": (lobes.from_harmonic, [unit(4, 5)]),
    "average_power": (lobes.average_power, [SETS]),
    "cross_power": (lobes.cross_power, [SETS, exact(SETS[::-1] + 0.5)]),
    "convolve_zonal": (lobes.convolve_zonal, [SETS, POWER[:4]]),
    "deconvolve_zonal": (lobes.deconvolve_zonal, [SETS, POWER[:4]]),
    "laplacian": (lobes.laplacian, [SETS]),
    "random_field": (lambda power: lobes.random_field(power, 1), [POWER]),
    "to_complex": (lobes.to_complex, [SETS]),
    "from_complex": (lobes.from_complex, [HALF_SETS]),
    "to_real": (lobes.to_real, [SETS]),
    "from_real": (lobes.from_real, [SETS]),
    "Mask.value": (lobes.Mask(1.0, 2.0).value, [exact(RNG.random((4, 5)) * 3)]),
    "Mask.apply": (lambda maps: lobes.Mask(1.0, 2.0).apply(TRANSFORM, maps), [MAPS]),
    "Coupling.couple": (SPECTRUM.couple, [POWER]),
    "Coupling.decouple": (lambda power, shape, weights: SPECTRUM.decouple(power, [0, 2, 5], shape, weights), [POWER, SHAPE, WEIGHTS]),
    "Coupling.windows": (lambda shape, weights: SPECTRUM.windows([0, 2, 5], shape, weights), [SHAPE, WEIGHTS]),
    "Coupling.from_power": (lambda power: lobes.Coupling.from_power(power, 4).matrix, [POWER]),
    "apodise": (lambda masks: lobes.apodise(TRANSFORM, masks, 0.5), [MASKS]),
    "EnvironmentMap": (lobes.EnvironmentMap, [PIXELS]),
    "EnvironmentMap.radiance": (LIGHT.radiance, [unit(4, 5)]),
    "fit_power_law": (lambda power: lobes.fit_power_law(power, 1, 4), [POWER]),
    "encode_exr": (lobes.encode_exr, [PIXELS]),
    "encode_png": (lobes.encode_png, [PIXELS, (RNG.random((6, 12)) < 0.5).astype(float)]),
    "write_exr": (lambda pixels: None, [PIXELS]),  # encode_exr
    "write_png": (lambda pixels: None, [PIXELS]),  # encode_png
    "linear_of_srgb": (lobes.linear_of_srgb, [exact(RNG.random((4, 5)))]),
    "srgb_of_linear": (lobes.srgb_of_linear, [exact(RNG.random((4, 5)))]),
    "Lobe.evaluate": (LOBE.evaluate, [VIEWS[0], LIGHTS.reshape(8, 5, 3)]),
    "Lobe.pdf": (LOBE.pdf, [VIEWS[0], LIGHTS.reshape(8, 5, 3)]),
    "Lobe.sample": (LOBE.sample, [VIEWS[0], exact(0.99 * RNG.random((4, 5, 2)))]),
    "Lobe.albedo_from": (LOBE.albedo_from, [VIEWS[0]]),
    "fit_lobe": (lambda *arrays: lobes.fit_lobe(*arrays, "gmd"), [LIGHTS, VIEWS, BRDF, exact(1 + RNG.random(40))]),
    "recover_kernel": (lobes.recover_kernel, [SETS[0, 0], exact(SETS[1, 0] + 0.5)]),
    "recover_lobe": (lobes.recover_lobe, [exact(np.linspace(1, 0.1, 9)), exact(np.linspace(0.01, 0.02, 9))]),
    "Material.plastic": (lambda colour: lobes.Material.plastic("m", colour, 0.1, 0.1), [np.array([0.5, 0.25, 0.125])]),
    "Material.metal": (lambda colour: lobes.Material.metal("m", colour, 0.1, 0.1), [np.array([0.5, 0.25, 0.125])]),
    "Material.from_albedos": (lambda *both: lobes.Material.from_albedos("m", *both, 0.1), [np.array([0.5, 0.25, 0.125]), np.array([0.25, 0.5, 0.75])]),
    "Material.from_albedos_gaining_energy": (
        lambda *both: lobes.Material.from_albedos_gaining_energy("m", *both, 0.1),
        [np.array([0.5, 0.25, 0.125]), np.array([0.25, 0.5, 0.75])],
    ),
    "Camera": (lobes.Camera, [np.array([1.0, 0.5, 2.0]), np.array([0.5, 1.0, 0.25])]),
    "Renderer.radiance": (lambda *both: lobes.Renderer(LIGHT).radiance(MATERIAL, *both), [VIEWS[:6].reshape(2, 3, 3), VIEWS[6:12].reshape(2, 3, 3)]),
    "GgxMaterial": (lambda *colours: lobes.GgxMaterial("m", 0.1, *colours), [np.array([0.5, 0.25, 0.125]), np.array([0.25, 0.5, 0.75])]),
    "LightTree.radiance": (
        lambda *both: lobes.LightTree(LIGHT).radiance(MATERIAL, *both, tolerance=0.1),
        [VIEWS[:6].reshape(2, 3, 3), VIEWS[6:12].reshape(2, 3, 3)],
    ),
    "Operator": (lambda rings: lobes.Operator(0.1, rings, 3).block(1, 0.5, 0.5), [ANGLES]),
    "Operator.forward": (lambda light: OPERATOR.forward(light, 0.5, 0.5, 8), [SETS[0, 0]]),
    "Operator.adjoint": (lambda picture: OPERATOR.adjoint(picture, 0.5, 0.5), [exact(RNG.random((4, 8)))]),
    "features": (lobes.features, [PICTURE]),
    "Picture": (lambda pixels, mask: lobes.Picture(pixels, mask=mask), [PICTURE, (RNG.random((40, 40)) < 0.5).astype(float)]),
    "Picture._from_radiance": (lambda pixels: lobes.Picture._from_radiance(pixels, False, None, None), [PICTURE]),
    "probe": (lambda circle: lobes.probe([lobes.Picture(PICTURE)], [1.0], circle, 8.0, rows=8), [CIRCLE]),
    "FinishReader.read": (lambda circle: READER.read(BALL, circle), [np.array([24.0, 24.0, 23.5])]),
    "FinishReader.light": (lambda circle: READER.light(BALL, circle, rows=8), [np.array([24.0, 24.0, 23.5])]),
}
# A sequence of numbers, but no array.
NO_ARRAYS = {"Coefficients.zeros", "Training", "Training._from_parts"}


def test_everything_that_takes_arrays_is_here():
    def array(value):
        return isinstance(value, (np.ndarray, lobes.Coefficients)) or isinstance(value, (list, tuple)) and value and all(isinstance(one, (int, float)) for one in value)

    taking = {name for name, (_, good) in GOOD.items() if any(array(one) for one in good)}
    assert taking - NO_ARRAYS <= set(CALLS) and set(CALLS) <= set(GOOD)


def alike(one, other):
    if isinstance(one, (tuple, list)):
        return len(one) == len(other) and all(map(alike, one, other))
    if dataclasses.is_dataclass(one) or isinstance(one, (lobes.EnvironmentMap, lobes.Picture)):
        return one == other
    return np.array_equal(one, other, equal_nan=isinstance(one, np.ndarray))


def strided(array):
    """Every second value of a larger array of NaN, from its end to its beginning."""
    large = np.full([2 * length for length in array.shape], np.nan, array.dtype)
    view = large[tuple(slice(-2, None, -2) for _ in array.shape)]
    view[...] = array
    return view


def frozen(array):
    array = array.copy()
    array.flags.writeable = False
    return array


LAYOUTS = {
    "single": lambda a: a.astype(np.complex64 if a.dtype.kind == "c" else np.float32),
    "strided single": lambda a: strided(a.astype(np.complex64 if a.dtype.kind == "c" else np.float32)),
    "strided": strided,
    "Fortran": np.asfortranarray,
    "bytes swapped": lambda a: a.astype(a.dtype.newbyteorder()),
    "read-only": frozen,
    "lists": lambda a: a.tolist(),
    "unaligned": lambda a: np.frombuffer(b"\0" + a.tobytes(), np.uint8)[1:].view(a.dtype).reshape(a.shape),
}


@pytest.mark.parametrize("name", CALLS)
def test_layouts(name):
    call, arrays = CALLS[name]
    truth = call(*[np.ascontiguousarray(array) for array in arrays])
    for layout, of in LAYOUTS.items():
        given = [of(array) for array in arrays]
        kept = [np.array(array) for array in given]
        assert alike(truth, call(*given)), layout
        assert all(map(np.array_equal, given, kept)), f"{layout}: an argument was changed"


def test_halves_integers_and_booleans():
    for dtype in ["float16", "int8", "int64", "uint16", "bool"]:
        maps = (4 * RNG.random((8, 16))).astype(dtype)
        assert np.array_equal(TRANSFORM.analyse(maps), TRANSFORM.analyse(maps.astype(float)))


def test_what_is_refused_says_why():
    for wrong in [np.ones((8, 16), complex), np.full((8, 16), "1"), np.full((8, 16), None), np.ones((8, 16), "M8[s]")]:
        with pytest.raises(TypeError, match="which are not real numbers"):
            TRANSFORM.analyse(wrong)
    with pytest.raises(TypeError, match="masked values"):
        TRANSFORM.analyse(np.ma.masked_less(MAPS[0], 0.5))
    with pytest.raises(TypeError, match="uint8, which are codes"):
        lobes.EnvironmentMap(np.ones((4, 8, 3), "uint8"))
