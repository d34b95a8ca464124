"""Mappings, and files written and read again."""

import lobes
import numpy as np
import pytest

SHAPES = [(24, 48), (48, 48), (48, 48), (64, 48), (48, 64)]
LAT_LONG = lobes.EnvironmentMap(lobes.builtin()[0].resampled(64).pixels, "city")


def light(direction):
    """A smooth light."""
    x, y, z = np.moveaxis(np.asarray(direction), -1, 0)
    return np.stack([1 + 0.5 * x, 1 + 0.5 * y, 1 + 0.5 * z], axis=-1)


def test_an_angular_map_is_turned_into_lat_long(tmp_path):
    size = 128
    y, x = np.mgrid[:size, :size]
    x, y = (2 * x + 1) / size - 1, 1 - (2 * y + 1) / size
    r = np.hypot(x, y)
    # Debevec's: the distance from the centre is the angle from -z, over π.
    scale = np.where(r > 0, np.sin(np.pi * r) / np.maximum(r, 1e-9), np.pi)
    probe = light(np.stack([scale * x, scale * y, -np.cos(np.pi * r)], axis=-1))
    probe[r > 1] = 0
    lobes.write_exr(tmp_path / "probe.exr", probe)
    read = lobes.EnvironmentMap.read(tmp_path / "probe.exr", mapping="angular-map")
    made = lobes.EnvironmentMap(probe, "probe", mapping="angular-map")
    assert read.name == "probe" and read.shape == made.shape == (64, 128)
    assert np.allclose(read.pixels, made.pixels, rtol=1e-6)
    directions = np.random.Generator(np.random.PCG64(4)).standard_normal((50, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    assert np.allclose(made.radiance(directions), light(directions), atol=0.02)
    with pytest.raises(OSError, match='mapping="angular-map" or mapping="mirror-ball"'):
        lobes.EnvironmentMap.read(tmp_path / "probe.exr")
    with pytest.raises(OSError, match="vertical-cross, which is 3:4") as raised:
        lobes.EnvironmentMap.read(tmp_path / "probe.exr", mapping="vertical-cross")
    assert "--" not in str(raised.value)


@pytest.mark.parametrize("mapping, shape", list(zip(lobes.MAPPINGS, SHAPES)))
def test_every_mapping_is_read(mapping, shape, tmp_path):
    lobes.write_exr(tmp_path / "white.exr", np.ones((*shape, 3)))
    white = lobes.EnvironmentMap.read(tmp_path / "white.exr", mapping)
    assert np.allclose(white.pixels, 1) and white.mean() == pytest.approx((1, 1, 1))
    assert [one.name for one in lobes.EnvironmentMap.read_folder(tmp_path, mapping)] == ["white"]


def test_openexr_comes_back(tmp_path):
    pixels = LAT_LONG.pixels
    lobes.write_exr(tmp_path / "city.exr", pixels)
    assert np.array_equal(lobes.read_linear(tmp_path / "city.exr"), pixels.astype("f4"))
    lobes.write_exr(str(tmp_path / "half.exr"), pixels, "half")
    assert (np.abs(lobes.read_linear(tmp_path / "half.exr") - pixels) < 0.501 * np.spacing(pixels.astype("f2"))).all()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["city.exr", "half.exr"]
    with pytest.raises(ValueError, match="ends at 65504"):
        lobes.write_exr(tmp_path / "large.exr", pixels + 1e5, "half")
    with pytest.raises(FileNotFoundError):
        lobes.write_exr(tmp_path / "no" / "city.exr", pixels)
    assert len(list(tmp_path.iterdir())) == 2


def test_renderings_are_written(tmp_path):
    rendering = lobes.Renderer(LAT_LONG).render(lobes.presets()[3], size=32, tolerance=1e-2)
    rendering.write(tmp_path / "a.exr")
    assert np.array_equal(lobes.read_linear(tmp_path / "a.exr"), rendering.pixels.astype("f4"))
    rendering.write(tmp_path / "a.png", exposure=0.5)
    picture = lobes.Picture.read(tmp_path / "a.png")
    assert picture.encoded and np.array_equal(picture.mask, rendering.mask)
    codes = np.round(255 * lobes.srgb_of_linear(np.clip(0.5 * rendering.pixels, 0, 1)))
    assert np.allclose(picture.pixels[rendering.mask], lobes.linear_of_srgb(codes / 255)[rendering.mask])
    with pytest.raises(ValueError, match="neither .exr nor .png"):
        rendering.write(tmp_path / "a.jpg")


def test_the_map_at_other_sizes():
    small = LAT_LONG.resampled(16)
    assert small.shape == (16, 32) and small.name == "city"
    assert np.allclose(small.pixels[0, 0], np.average(LAT_LONG.pixels[:4, :4].mean(1), axis=0, weights=ring_weights(64)[:4]))
    assert LAT_LONG.clipped(0.01).pixels.max() < LAT_LONG.pixels.max()


def ring_weights(rows):
    edges = np.cos(np.pi * np.arange(rows + 1) / rows)
    return edges[:-1] - edges[1:]
