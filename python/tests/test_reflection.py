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


@pytest.mark.parametrize("lobe", [lobes.Lobe("sampled", 0.3), lobes.Lobe("gmd", 0.2), lobes.Lobe("duer", 0.1, 0.4)])
def test_samples_are_drawn_with_their_density(lobe):
    rng = np.random.Generator(np.random.PCG64(11))
    view = [0.48, 0.36, 0.8]
    lights, weights = lobe.sample(view, rng.random((40, 500, 2)))
    assert lights.shape == (40, 500, 3) and weights.shape == (40, 500)
    assert np.allclose(np.linalg.norm(lights, axis=-1), 1)
    # The weight is the lobe over its density; the mean weight is the albedo.
    seen = weights > 0
    assert np.allclose((weights * lobe.pdf(view, lights))[seen], lobe.evaluate(view, lights)[seen], rtol=1e-9)
    error = weights.std() / np.sqrt(weights.size)
    assert abs(weights.mean() - lobe.albedo_from(view)) <= 4 * error + 1e-12


def test_closed_forms_keep_their_bounds():
    lobe = lobes.Lobe("duer", 0.05)
    exact = lobe.zonal(1.0, 40)
    for form in ("series", "gaussian"):
        values, bounds = lobe.approximate(40, form)
        assert (np.abs(values - exact) <= bounds).all() and bounds.max() < 0.03
    values, bound = lobe.approximate_oblique(0.6, 40)
    assert np.abs(values - lobe.zonal(0.6, 40)).max() <= bound < 0.03
    coefficients = lobes.Lobe("sampled", 0.2).isotropic_coefficients(2, 3)
    assert coefficients.shape == (3, 4, 3) and coefficients[0, 0, 0] == pytest.approx(0.5, abs=1e-12)


def measured(lobe, diffuse, specular):
    angle = 0.03 * np.arange(50) - 0.1
    lights = np.stack([-np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    view = [0.6, 0.0, 0.8]
    values = diffuse / np.pi + specular * lobe.evaluate(view, lights) / lights[:, 2]
    return lights, np.tile(view, (50, 1)), values


def test_a_fit_finds_what_was_measured(tmp_path):
    lights, views, values = measured(lobes.Lobe("sampled", 0.1), 0.2, 0.3)
    fit = lobes.fit_lobe(lights, views, values)
    assert fit.variant == "sampled" and fit.measurements == 50
    assert float(fit.sigma[0]) == pytest.approx(0.1, abs=1e-9) and fit.specular.value == pytest.approx(0.3, abs=1e-9)
    theta = np.degrees(np.arccos(lights[:, 2]))
    phi = np.where(lights[:, 0] < 0, 180, 0)
    rows = [f"{t},{p},{np.degrees(np.arccos(0.8))},0,{v}" for t, p, v in zip(theta, phi, values)]
    (tmp_path / "a.csv").write_text("theta_i,phi_i,theta_o,phi_o,value\n" + "\n".join(rows))
    table = lobes.read_csv(tmp_path / "a.csv")
    assert len(table) == 50 and np.allclose(table.lights, lights) and np.allclose(table.values, values)
    with pytest.raises(ValueError, match="views has 49 entries"):
        lobes.fit_lobe(lights, views[1:], values)
    with pytest.raises(OSError, match="b.binary"):
        lobes.read_merl(tmp_path / "b.binary", 0)


def test_a_lobe_is_recovered_from_its_kernel():
    kernel = 0.3 * lobes.lambert(40) / np.pi + 0.5 * lobes.Lobe("gmd", 0.1).zonal(1.0, 40)
    found = lobes.recover_lobe(kernel, np.full(41, 1e-6), "gmd")
    assert found.sigma.value == pytest.approx(0.1, rel=1e-4) and found.diffuse.value == pytest.approx(0.3, rel=1e-4)


def test_radiance_is_that_of_the_picture():
    renderer = lobes.Renderer(lobes.builtin()[0].resampled(64))
    camera = lobes.Camera(towards=[1, 0.3, 0.5], distance=4.0, roll=0.2)
    material = lobes.Material.plastic("p", [0.3, 0.2, 0.1], 0.05, 0.1)
    rendering = renderer.render(material, camera=camera, size=16)
    normals, views = camera.shading_points(16)
    assert np.array_equal(np.isnan(normals[..., 0]), ~rendering.mask)
    values, error = renderer.radiance(material, normals[rendering.mask], views[rendering.mask].astype("f4"))
    assert error < 1e-3 and np.allclose(values, rendering.pixels[rendering.mask], rtol=4e-3)


def test_a_white_sphere_in_white_light_is_white():
    light = lobes.EnvironmentMap(np.ones((32, 64, 3)))
    rendering = lobes.Renderer(light).render(lobes.Material.white(), size=32)
    assert rendering.pixels.shape == (32, 32, 3) and 0.7 < rendering.mask.mean() < 0.8
    assert np.abs(rendering.pixels[rendering.mask] - 1).max() < 1e-3 and rendering.error < 1e-3
    assert (rendering.pixels[~rendering.mask] == 0).all() and np.asarray(rendering) is rendering.pixels


def test_threads_do_not_change_a_byte():
    renderer = lobes.Renderer(lobes.builtin()[0])
    one, two = (renderer.render(lobes.presets()[0], size=24, threads=threads) for threads in (False, True))
    assert one == two and one.pixels.tobytes() == two.pixels.tobytes()


def test_brightness_changes_colour_alone():
    renderer = lobes.Renderer(lobes.builtin()[2])
    rendering = renderer.render(lobes.Material.metal("metal", [0.8] * 3, 0.9, 0.1), size=64, camera=lobes.Camera().rolled(0.3))
    before, after = lobes.features(rendering), lobes.features(3 * rendering.pixels)
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
        (lambda: lobes.Material.from_albedos("m", [0.9] * 3, [0.9] * 3, 0.1), r"at most 1 \(Material.from_albedos_gaining_energy"),
        (lambda: lobes.Lobe("duer", 0.1).evaluate([0, 0, 2], [0, 0, 1]), "length 2"),
        (lambda: lobes.Lobe("duer", 0.1).pdf([0, 0, 1], [[0, 0, 1], [0, 0.5, 0]]), "length 0.5 at index 1"),
        (lambda: lobes.Lobe("duer", 0.1).sample([0, 0, 1], [0.5, 1.0]), "not in"),
        (lambda: lobes.EnvironmentMap(np.zeros((8, 8, 3)), mapping="sphere"), "there is no"),
    ]:
        with pytest.raises(ValueError, match=sentence):
            wrong()
    with pytest.raises(TypeError, match="codes and not linear radiance"):
        lobes.EnvironmentMap(np.ones((4, 8, 3), np.uint8))
    with pytest.raises(FileNotFoundError, match="none.exr"):
        lobes.EnvironmentMap.read(tmp_path / "none.exr")


def test_the_operator_of_a_view():
    operator = lobes.Operator(0.0, [0.2, 0.7, 1.2], 6, variant="duer")
    assert operator.degree == 6 and np.array_equal(operator.rings, [0.2, 0.7, 1.2])
    # A mirror shows at the normal (θ, φ) the light from (2θ, φ).
    rng = np.random.Generator(np.random.PCG64(5))
    light = lobes.Coefficients(rng.standard_normal(49))
    columns = 16
    phi, theta = 2 * np.pi * np.arange(columns) / columns, 2 * operator.rings[:, None]
    seen = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1)
    picture = operator.forward(light, 0.0, 1.0, columns)
    assert np.allclose(picture, lobes.synthesise_at(light, seen), atol=1e-13)
    # Lambert: A_l Y_lm/π, here of the zonal harmonics.
    zonal = lobes.Coefficients.zeros(6)
    zonal.array[:7] = light.array[:7]
    shaded = lobes.convolve_zonal(zonal, lobes.lambert(6) / np.pi)
    normals = np.stack([np.sin(operator.rings), 0 * operator.rings, np.cos(operator.rings)], axis=-1)
    assert np.allclose(operator.block(0, 1.0, 0.0) @ light.array[:7], lobes.synthesise_at(shaded, normals), atol=1e-14)
    # The adjoint.
    other = rng.standard_normal((3, columns))
    back = operator.adjoint(other, 0.0, 1.0)
    assert back.degree == 6 and np.vdot(picture, other) == pytest.approx(np.vdot(light.array, back.array), rel=1e-13)
    near = lobes.Operator(0.2, 5, 4, distance=3.0)
    assert near.rings.max() < np.arccos(1 / 3) and "distance=3.0" in repr(near)
    for wrong, sentence in [
        (lambda: lobes.Operator(-0.1, 4, 4), "roughness"),
        (lambda: lobes.Operator(0.1, [2.0], 4), "limb"),
        (lambda: lobes.Operator(0.1, [[0.1]], 4), r"not \(rings,\)"),
        (lambda: lobes.Operator(0.1, 4, 257), "256"),
        (lambda: operator.forward(light, 0.0, 1.0, 12), "13"),
        (lambda: operator.adjoint(other[:2], 0.0, 1.0), "2 rows"),
        (lambda: operator.block(7, 1.0, 0.0), "7"),
    ]:
        with pytest.raises(ValueError, match=sentence):
            wrong()


def test_the_tree_proves_its_bounds():
    light = lobes.EnvironmentMap(np.ones((16, 32, 3)), "even")
    tree = lobes.LightTree(light)
    glass = lobes.GgxMaterial("glass", 0.3, index=[1.5] * 3)
    rendering, bounds = tree.render(glass, size=8, tolerance=1e-2)
    assert rendering.pixels.shape == (8, 8, 3) and bounds.shape == (8, 8)
    assert 0 < rendering.error <= 1e-2 and np.all((bounds > 0) == rendering.mask)
    # In even light facets show less than Fresnel's reflectance of the view would say at grazing, and
    # about it along the normal.
    assert rendering.pixels[4, 4, 0] == pytest.approx(glass.reflectance(1.0)[0], rel=0.2)
    # The mean over a pixel of the picture is that of four pixels of one with twice as many a side.
    finer, _ = tree.render(glass, size=16, tolerance=1e-2)
    mean, bounds = tree.render(glass, size=8, tolerance=1e-2, pixel_samples=2)
    four = finer.pixels[6:8, 8:10, 0]
    assert abs(mean.pixels[3, 4, 0] - four.mean()) <= bounds[3, 4] + 1e-2 * four.mean()
    with pytest.raises(ValueError, match="samples"):
        tree.render(glass, size=8, pixel_samples=0)
    # Ward's lobes within the bound of the renderer's, whose error is an estimate.
    material, normals = lobes.presets()[2], np.array([[0, 0, 1.0], [0.6, 0, 0.8]])
    views = np.array([[0, 0, 1.0]] * 2)
    light = lobes.builtin()[0].resampled(64)
    values, bounds = lobes.LightTree(light).radiance(material, normals, views, "gmd", 1e-4)
    others, error = lobes.Renderer(light).radiance(material, normals, views, "gmd", 1e-4)
    assert values.shape == (2, 3) and bounds.shape == (2,)
    assert np.allclose(values, others, rtol=5 * error + 2e-4)
    # Turned on a lathe whose axis points at the camera: its highlight is the same all round.
    turned = lobes.GgxMaterial("turned", (0.05, 0.3), f0=[0.9] * 3, axis=[0, 0, 1])
    assert (turned.alpha, turned.axis) == ((0.05, 0.3), (0.0, 0.0, 1.0))
    seen = tree.render(turned, size=8, tolerance=1e-3)[0].pixels[..., 0]
    assert np.allclose(seen, np.rot90(seen), rtol=3e-3) and 0.7 < seen[4, 4] < 0.9
    for alpha, axis, sentence in ((0.1, [0, 1, 0], "two widths"), ((0.1, 0.2), [0, 2, 0], "axis"), ((0.0, 0.2), None, "width")):
        with pytest.raises(ValueError, match=sentence):
            lobes.GgxMaterial("m", alpha, f0=[0.5] * 3, axis=axis)
    for alpha in ("wide", [], [0.1], [0.1, 0.2, 0.3], None):
        with pytest.raises(TypeError, match="along, across"):
            lobes.GgxMaterial("m", alpha, f0=[0.5] * 3)
    with pytest.raises(TypeError, match="GgxMaterial"):
        tree.render("glass")
    with pytest.raises(ValueError, match="f0"):
        lobes.GgxMaterial("nothing", 0.1)
