"""Whatever is given, what comes out is an answer or one of Python's own errors: no panic, no abort."""

import itertools
import random

import lobes
import numpy as np
import pytest

ALLOWED = (ValueError, TypeError, OverflowError, MemoryError, OSError, IndexError)

INTEGERS = [0, 1, 2, 3, -1, 7, 2**16, 10**6, 10**10, 2**31, 2**32, 2**62, 2**63, 2**64, 2**70, -(2**63), True]
FLOATS = [0.0, -0.0, 0.5, 1.0, 2.0, -1.0, 1e-320, 1e308, -1e308, 1e-7, float("inf"), float("-inf"), float("nan")]
ARRAYS = [
    np.zeros(0),
    np.zeros((0, 3)),
    np.zeros((3, 0)),
    np.zeros((0, 4, 8)),
    np.array(1.0),
    np.ones(1),
    np.ones(4),
    np.full(4, 1e308),
    np.full(4, np.nan),
    np.full(16, -np.inf),
    np.array([0.0, 0.0, 1.0]),
    np.array([0.0, 0.0, -1.0]),
    np.full(3, 1e-320),
    np.full(3, 1e308),
    np.ones((5, 3)) / np.sqrt(3),
    np.zeros((2, 3, 3)),
    np.ones((4, 8, 3)),
    np.full((4, 8, 3), -1.0),
    np.full((4, 8, 3), np.nan),
    np.full((4, 8, 3), 1e308),
    np.full((9, 9, 3), 255, np.uint8),
    np.ones((4, 8)),
    np.ones(6, complex),
    np.full(6, np.nan * 1j),
    np.array(["a", "b"]),
    np.array([None, 1]),
    np.array([1 << 70, 2]),
    np.zeros(3, "M8[s]"),
    np.zeros(2, [("a", "f8")]),
    np.broadcast_to(1.0, (1 << 20, 1)),
]
OTHERS = [None, "", "sampled", "\0", "é" * 1000, b"bytes", [], [[1], [1, 2]], (), {}, object(), 1j, lambda: 1, [1, 2, 3], ["a"]]
ANYTHING = INTEGERS + FLOATS + ARRAYS + OTHERS

LIGHT = lobes.EnvironmentMap(np.ones((4, 8, 3)))
TRANSFORM = lobes.Transform("lat-long", 8, 16, 3)
SINGLE = lobes.SingleTransform("lat-long", 8, 16, 3)
DIRECTION = np.array([0.0, 0.6, 0.8])
SET = lobes.Coefficients(np.ones(16))
OPERATOR = lobes.Operator(0.1, 4, 3, threads=False)

# Every public callable, with arguments that it takes.
GOOD = {
    "Transform": (lobes.Transform, ("lat-long", 8, 16, 3, 2, 0.5, True)),
    "Transform.analyse": (TRANSFORM.analyse, (np.ones((8, 16)), False)),
    "Transform.synthesise": (TRANSFORM.synthesise, (SET, False)),
    "Transform.synthesise_adjoint": (TRANSFORM.synthesise_adjoint, (np.ones((8, 16)), False)),
    "Transform.analyse_adjoint": (TRANSFORM.analyse_adjoint, (SET, False)),
    "Transform.healpix": (lobes.Transform.healpix, (2, 4, 3)),
    "Transform.analyse_least_squares": (TRANSFORM.analyse_least_squares, (np.ones((8, 16)), 1e-9, False)),
    "Transform.analyse_iterated": (TRANSFORM.analyse_iterated, (np.ones((8, 16)), 2, False)),
    "Transform.gradient": (TRANSFORM.gradient, (SET, False)),
    "Transform.synthesise_complex": (TRANSFORM.synthesise_complex, (np.ones(16, complex), False)),
    "Transform.analyse_complex": (TRANSFORM.analyse_complex, (np.ones((8, 16), complex), False)),
    "SingleTransform": (lobes.SingleTransform, ("lat-long", 8, 16, 3, 3, 0.0, True)),
    "SingleTransform.analyse": (SINGLE.analyse, (np.ones((8, 16)), False)),
    "SingleTransform.synthesise": (SINGLE.synthesise, (SET, False)),
    "SingleTransform.synthesise_adjoint": (SINGLE.synthesise_adjoint, (np.ones((8, 16)), False)),
    "SingleTransform.analyse_adjoint": (SINGLE.analyse_adjoint, (SET, False)),
    "Rotation": (lobes.Rotation, (3,)),
    "Rotation.rotate_complex": (lobes.Rotation(3).rotate_complex, (np.ones(16, complex), [0, 0, 0, 1], False)),
    "Rotation.rotate": (lobes.Rotation(3).rotate, (SET, [0, 0, 0, 1], False)),
    "Coefficients": (lobes.Coefficients, (np.ones(4), 3, 0)),
    "Coefficients.zeros": (lobes.Coefficients.zeros, (3, 2, (2,))),
    "Coefficients.get": (SET.get, (2, -1)),
    "Coefficients.index": (SET.index, (2, -1)),
    "Coefficients.with_degree": (SET.with_degree, (2,)),
    "basis": (lobes.basis, (DIRECTION, 3, False)),
    "basis_gradients": (lobes.basis_gradients, (DIRECTION, 3, False)),
    "synthesise_at": (lobes.synthesise_at, (SET, DIRECTION, False, 1e-6)),
    "synthesise_at_adjoint": (lobes.synthesise_at_adjoint, (np.ones(1), DIRECTION[None], 3, False, 1e-6)),
    "analyse_at": (lobes.analyse_at, (np.ones(1), DIRECTION[None], 0, 1e-9, False)),
    "wigner_d": (lobes.wigner_d, (3, 0.5)),
    "wigner_rotation": (lobes.wigner_rotation, (3, [0, 0, 0, 1])),
    "wigner_rotation_real": (lobes.wigner_rotation_real, (3, [0, 0, 0, 1])),
    "rotate_splats": (lobes.rotate_splats, (np.ones((2, 15, 3), np.float32), [0, 0, 0, 1], "gltf", -2, False)),
    "gradients_at": (lobes.gradients_at, (SET, DIRECTION, False)),
    "to_harmonic": (lobes.to_harmonic, (DIRECTION,)),
    "from_harmonic": (lobes.from_harmonic, (DIRECTION,)),
    "average_power": (lobes.average_power, (SET,)),
    "cross_power": (lobes.cross_power, (SET, SET)),
    "convolve_zonal": (lobes.convolve_zonal, (SET, np.ones(4))),
    "deconvolve_zonal": (lobes.deconvolve_zonal, (SET, np.ones(4), 0.1)),
    "gaussian_beam": (lobes.gaussian_beam, (4, 0.1)),
    "laplacian": (lobes.laplacian, (SET,)),
    "random_field": (lobes.random_field, (np.ones(4), 1)),
    "to_complex": (lobes.to_complex, (SET, "orthonormal", "plain")),
    "from_complex": (lobes.from_complex, (np.ones(10), "orthonormal", "plain")),
    "to_real": (lobes.to_real, (SET, "orthonormal", "plain", "by-order")),
    "from_real": (lobes.from_real, (np.ones(16), "orthonormal", "plain", "by-order")),
    "Mask": (lobes.Mask, (1.0, 1.5)),
    "Mask.value": (lobes.Mask(1.0).value, (np.ones(3),)),
    "Mask.apply": (lobes.Mask(1.0).apply, (TRANSFORM, np.ones((8, 16)))),
    "Coupling": (lobes.Coupling, (lobes.Mask(1.0), 4)),
    "Coupling.couple": (lobes.Coupling(lobes.Mask(1.0), 4).couple, (np.ones(5),)),
    "Coupling.decouple": (lobes.Coupling(lobes.Mask(2.5), 4).decouple, (np.ones(5), [0, 2, 5], np.ones(5), np.ones(5))),
    "Coupling.from_power": (lobes.Coupling.from_power, (np.ones(5), 4)),
    "Coupling.windows": (lobes.Coupling(lobes.Mask(2.5), 4).windows, ([0, 2, 5], np.ones(5), np.ones(5))),
    "apodise": (lobes.apodise, (TRANSFORM, np.ones((8, 16)), 0.5, "c2", False)),
    "EnvironmentMap": (lobes.EnvironmentMap, (np.ones((4, 8, 3)), "name", "lat-long")),
    "EnvironmentMap.read": (lobes.EnvironmentMap.read, ("/no/such/file.exr", "lat-long")),
    "EnvironmentMap.read_folder": (lobes.EnvironmentMap.read_folder, ("/no/such/folder", "lat-long")),
    "EnvironmentMap.radiance": (LIGHT.radiance, (DIRECTION,)),
    "EnvironmentMap.resampled": (LIGHT.resampled, (4,)),
    "EnvironmentMap.clipped": (LIGHT.clipped, (0.1,)),
    "EnvironmentMap.coefficients": (LIGHT.coefficients, (1, False)),
    "EnvironmentMap.spectrum": (lobes.builtin()[0].resampled(16).spectrum, (7, False)),
    "fit_power_law": (lobes.fit_power_law, (1 / np.arange(1, 9.0), 1, 5)),
    "read_linear": (lobes.read_linear, ("/no/such/file.exr",)),
    "encode_exr": (lobes.encode_exr, (np.ones((2, 3, 3)), "half")),
    "encode_png": (lobes.encode_png, (np.ones((2, 3, 3)), np.ones((2, 3)), 0.5)),
    "write_exr": (lobes.write_exr, ("/no/such/file.exr", np.ones((2, 3, 3)), "half")),
    "write_png": (lobes.write_png, ("/no/such/file.png", np.ones((2, 3, 3)), np.ones((2, 3)), 0.5)),
    "linear_of_srgb": (lobes.linear_of_srgb, (np.ones(3),)),
    "srgb_of_linear": (lobes.srgb_of_linear, (np.ones(3),)),
    "Lobe": (lobes.Lobe, ("duer", 0.1, 0.2)),
    "Lobe.evaluate": (lobes.Lobe("sampled", 0.1).evaluate, (DIRECTION, DIRECTION)),
    "Lobe.pdf": (lobes.Lobe("sampled", 0.1).pdf, (DIRECTION, DIRECTION)),
    "Lobe.sample": (lobes.Lobe("sampled", 0.1).sample, (DIRECTION, [0.5, 0.5])),
    "Lobe.albedo": (lobes.Lobe("duer", 0.1).albedo, (0.5,)),
    "Lobe.albedo_from": (lobes.Lobe("duer", 0.1, 0.2).albedo_from, (DIRECTION,)),
    "Lobe.share_above_horizon": (lobes.Lobe("duer", 0.1).share_above_horizon, (0.5,)),
    "Lobe.zonal": (lobes.Lobe("duer", 0.1).zonal, (0.5, 4)),
    "Lobe.approximate": (lobes.Lobe("duer", 0.1).approximate, (4, "series")),
    "Lobe.approximate_oblique": (lobes.Lobe("duer", 0.1).approximate_oblique, (0.5, 4)),
    "Lobe.isotropic_coefficients": (lobes.Lobe("gmd", 0.3).isotropic_coefficients, (1, 2)),
    "lambert": (lobes.lambert, (3,)),
    "fit_lobe": (lobes.fit_lobe, (np.tile(DIRECTION, (6, 1)), np.tile(DIRECTION, (6, 1)), np.arange(6.0), np.ones(6), "gmd", 1)),
    "read_csv": (lobes.read_csv, ("/no/such/file.csv",)),
    "read_merl": (lobes.read_merl, ("/no/such/file.binary", 1)),
    "recover_kernel": (lobes.recover_kernel, (SET, SET)),
    "recover_lobe": (lobes.recover_lobe, (np.linspace(1, 0.1, 9), np.full(9, 0.01), "gmd")),
    "Material.plastic": (lobes.Material.plastic, ("name", [0.5] * 3, 0.1, 0.1)),
    "Material.metal": (lobes.Material.metal, ("name", [0.5] * 3, 0.1, 0.1)),
    "Material.from_albedos": (lobes.Material.from_albedos, ("name", [0.5] * 3, [0.1] * 3, 0.1)),
    "Material.from_albedos_gaining_energy": (
        lobes.Material.from_albedos_gaining_energy,
        ("name", [0.5] * 3, [0.9] * 3, 0.1),
    ),
    "Material.lobe": (lobes.Material.white().lobe, ("gmd",)),
    "Camera": (lobes.Camera, ([0, 0, 1], [0, 1, 0], 2.0, 0.1)),
    "Camera.rolled": (lobes.Camera().rolled, (0.1,)),
    "Camera.shading_points": (lobes.Camera().shading_points, (4,)),
    "Renderer": (lobes.Renderer, (LIGHT, False)),
    "Renderer.render": (
        lobes.Renderer(LIGHT).render,
        (lobes.Material.white(), "gmd", lobes.Camera(), 4, 0.1, 1, False),
    ),
    "Renderer.radiance": (
        lobes.Renderer(LIGHT).radiance,
        (lobes.Material.white(), DIRECTION, DIRECTION, "gmd", 0.1, False),
    ),
    "GgxMaterial": (lobes.GgxMaterial, ("name", (0.1, 0.2), [0.5] * 3, None, [1.5] * 3, [0.1] * 3, [0.0, 1.0, 0.0])),
    "GgxMaterial.reflectance": (lobes.GgxMaterial("m", 0.1, f0=[0.04] * 3).reflectance, (0.5,)),
    "LightTree": (lobes.LightTree, (LIGHT, False)),
    "LightTree.render": (
        lobes.LightTree(LIGHT).render,
        (lobes.Material.white(), "gmd", lobes.Camera(), 4, 0.1, 2, False),
    ),
    "LightTree.radiance": (
        lobes.LightTree(LIGHT).radiance,
        (lobes.Material.white(), DIRECTION, DIRECTION, "gmd", 0.1, False),
    ),
    "Operator": (lobes.Operator, (0.1, 4, 4, "duer", 3.0, False)),
    "Operator.block": (OPERATOR.block, (1, 0.5, 0.1)),
    "Operator.forward": (OPERATOR.forward, (SET, 0.5, 0.1, 8)),
    "Operator.adjoint": (OPERATOR.adjoint, (np.ones((4, 8)), 0.5, 0.1)),
    "features": (lobes.features, (np.ones((9, 9, 3)), "zero")),
    "Picture": (lobes.Picture, (np.ones((9, 9, 3)), True, np.ones((9, 9)), 10.0)),
    "Picture.read": (lobes.Picture.read, ("/no/such/file.png",)),
    "Picture._from_radiance": (lobes.Picture._from_radiance, (np.ones((9, 9, 3)), True, np.ones((9, 9)), 10.0)),
    "Training": (lobes.Training, ([], [], "sampled", 0, False, None)),
    "Training._from_parts": (
        lobes.Training._from_parts,
        (["a"], ["b"], np.zeros((1, 3), np.uint64), np.zeros((1, 2)), np.zeros((1, 4)), np.zeros((1, 2)), 0.1),
    ),
    "Model": (lobes.Model, (None, False)),
    "evaluate": (lobes.evaluate, (LIGHT, LIGHT, "recommended", 8, False)),
    "probe": (
        lobes.probe,
        ([lobes.Picture(np.ones((40, 40, 3)))], [1.0], (20.0, 20.0, 15.0), 8.0, [0.6] * 3, 10.0, 8, False),
    ),
    "FinishReader.light": (lobes.FinishReader().light, (lobes.Picture(np.ones((40, 40, 3))), (20.0, 20.0, 15.0), 8, False)),
    "FinishReader.read": (lobes.FinishReader().read, (lobes.Picture(np.ones((40, 40, 3))), (20.0, 20.0, 15.0))),
}
WITHOUT_ARGUMENTS = {"FinishReader", "Material", "builtin", "presets", "vectors", "Material.white", "EnvironmentMap.mean", "Picture.circle"}
# Made by functions, and dataclasses: they hold what they are given.
RECORDS = {"Estimate", "FinishVerdict", "Fit", "LightSpectrum", "Measurements", "PowerLaw", "Recovered", "Rendering", "Verdict"}


def attempt(name, call, arguments):
    try:
        call(*arguments)
    except ALLOWED as error:
        sentence = str(error)
        assert "--" not in sentence and "::" not in sentence and "panicked" not in sentence, (name, sentence)
    except BaseException as error:
        raise AssertionError(f"{name}{arguments!r:.300} gave {type(error)}: {error}") from error


def public():
    for name in lobes.__all__:
        value = getattr(lobes, name)
        if not callable(value) or name in RECORDS:
            continue
        yield name
        if isinstance(value, type):
            for inner in dir(value):
                own = inner == "_from_parts" or inner == "_from_radiance" or not inner.startswith("_")
                if own and callable(getattr(value, inner)):
                    yield f"{name}.{inner}"


def test_every_public_callable_is_here():
    assert set(public()) - WITHOUT_ARGUMENTS - {"Model.read"} == set(GOOD)


@pytest.mark.parametrize("name", GOOD)
def test_nasty_arguments(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    call, good = GOOD[name]
    attempt(name, call, good)
    for place, value in itertools.product(range(len(good)), ANYTHING):
        attempt(name, call, (*good[:place], value, *good[place + 1 :]))
    # Two and more at once, by chance; the same every time.
    chance = random.Random(name)
    for _ in range(200):
        attempt(name, call, [chance.choice(ANYTHING) if chance.random() < 0.6 else one for one in good])
    for count in range(len(good)):
        attempt(name, call, good[:count])


def test_sizes_that_no_machine_holds():
    renderer = lobes.Renderer(LIGHT)
    for wrong in [
        lambda: lobes.basis(np.broadcast_to(DIRECTION, (1 << 22, 3)), 2048),
        lambda: lobes.basis_gradients(np.broadcast_to(DIRECTION, (1 << 22, 3)), 2048),
        lambda: renderer.render(lobes.Material.white(), size=16384, pixel_samples=64),
    ]:
        with pytest.raises(MemoryError):
            wrong()
    for wrong in [
        lambda: lobes.lambert(10**10),
        lambda: lobes.lambert(2**63),
        lambda: lobes.basis(DIRECTION, 10**6),
        lambda: lobes.basis(DIRECTION, 2**64 - 1),
        lambda: lobes.Rotation(2**63),
        lambda: lobes.Transform("fejer", 8, 16, 2**64 - 1, 2**64 - 1),
        lambda: lobes.Lobe("duer", 0.1).isotropic_coefficients(2**63, 2**63),
        lambda: lobes.Coupling(lobes.Mask(1.0), 2**63),
        lambda: LIGHT.resampled(2**62),
        lambda: LIGHT.coefficients(2**64 - 1),
    ]:
        with pytest.raises(ValueError):
            wrong()
