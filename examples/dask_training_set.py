"""Renders a training set with Dask: every material under every light from cameras all round, a Parquet file a partition.

    pip install dist/lobes-*.whl "dask[distributed]" pyarrow
    python examples/dask_training_set.py OUT                      # two worker processes on this machine
    python examples/dask_training_set.py OUT --scheduler tcp://…  # a cluster that is there already
    python examples/dask_training_set.py OUT --processes 0        # this process alone: the same bytes

A partition is one light and one camera. It is written aside and renamed when it is whole, so what is there is complete: start the command
again and it does what is missing. A worker that dies costs the partition that it was at, which Dask gives to another.
Each row is a sphere: light, azimuth, elevation, material, its albedos and sigma, the estimated error of the rendering, the paper's ten
features, and the image as 32-bit floats, rows from the top, NaN outside of the sphere.
"""

import argparse
import functools
import math
import os
import pathlib
import sys
import time

import lobes
import numpy as np
import pyarrow as pa
import pyarrow.parquet

VARIANT = "sampled"


@functools.cache
def lights():
    return {light.name: light for light in lobes.builtin()}


@functools.lru_cache(maxsize=1)  # the partitions of one light come one after the other
def renderer(light):
    return lobes.Renderer(lights()[light], threads=False)


def partition_name(partition):
    light, azimuth, elevation = partition
    return f"{light}_{azimuth:03.0f}_{elevation:+03.0f}.parquet"


def camera(azimuth, elevation):
    """The camera of `lobes render`: an azimuth of 0 looks along -z and grows to the left."""
    a, e = math.radians(azimuth), math.radians(elevation)
    return lobes.Camera(towards=[math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e)])


def render_partition(out, partition, size, tolerance):
    """Renders one partition into its file and gives the file's name."""
    light, azimuth, elevation = partition
    rows = []
    for material in lobes.presets():
        rendering = renderer(light).render(
            material, VARIANT, camera=camera(azimuth, elevation), size=size, tolerance=tolerance, threads=False
        )
        rows.append(
            {
                "light": light,
                "azimuth": azimuth,
                "elevation": elevation,
                "material": material.name,
                "diffuse": list(material.diffuse),
                "specular": list(material.specular),
                "sigma": material.sigma,
                "error": rendering.error,
                **dict(zip(lobes.FEATURE_NAMES, map(float, lobes.features(rendering)))),
                "image": np.where(rendering.mask[..., None], rendering.pixels, np.nan).astype("float32").ravel(),
            }
        )
    schema = pa.schema(
        [("light", pa.string()), ("azimuth", pa.float64()), ("elevation", pa.float64()), ("material", pa.string())]
        + [("diffuse", pa.list_(pa.float64(), 3)), ("specular", pa.list_(pa.float64(), 3)), ("sigma", pa.float64())]
        + [(name, pa.float64()) for name in ("error", *lobes.FEATURE_NAMES)]
        + [("image", pa.list_(pa.float32(), 3 * size * size))]
    )
    path = pathlib.Path(out) / partition_name(partition)
    for left_by_the_dead in path.parent.glob(f"{path.stem}.*.part"):
        left_by_the_dead.unlink(missing_ok=True)
    aside = path.with_suffix(f".{os.getpid()}.part")
    pa.parquet.write_table(pa.Table.from_pylist(rows, schema), aside, compression="zstd")
    aside.replace(path)
    return path.name


def missing(out, partitions):
    return [partition for partition in partitions if not (pathlib.Path(out) / partition_name(partition)).exists()]


def run(client, out, partitions, size, tolerance):
    """The names of the partitions' files as they are done, by a Dask client or, where it is None, by this process."""
    if client is None:
        yield from (render_partition(out, partition, size, tolerance) for partition in partitions)
        return
    from dask.distributed import as_completed

    futures = [
        client.submit(render_partition, out, partition, size, tolerance, key=partition_name(partition), pure=False)
        for partition in partitions
    ]
    for future in as_completed(futures):
        yield future.result()


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("out", type=pathlib.Path)
    options.add_argument("--scheduler", help="the address of a Dask scheduler")
    options.add_argument("--processes", type=int, default=2, help="worker processes of a cluster of one's own; 0 for none")
    options.add_argument("--lights", nargs="*", help="names of built-in maps; all if none is named")
    options.add_argument("--cameras", type=int, default=4, help="how many, all round")
    options.add_argument("--size", type=int, default=128)
    options.add_argument("--tolerance", type=float, default=1e-3)
    options = options.parse_args()
    if unknown := set(options.lights or ()) - set(lights()):
        sys.exit(f"there is no light {', '.join(sorted(unknown))}; there are {', '.join(lights())}")
    options.out.mkdir(parents=True, exist_ok=True)
    partitions = [
        (light, 360 * i / options.cameras, 0.0) for light in options.lights or lights() for i in range(options.cameras)
    ]
    todo = missing(options.out, partitions)
    client = None
    if todo and (options.scheduler or options.processes):
        from dask.distributed import Client, LocalCluster

        client = Client(
            options.scheduler or LocalCluster(n_workers=options.processes, threads_per_worker=1, dashboard_address=None)
        )
    start = time.monotonic()
    for done, name in enumerate(run(client, str(options.out.resolve()), todo, options.size, options.tolerance), start=1):
        print(f"{done}/{len(todo)} {name}", file=sys.stderr)
    seconds = time.monotonic() - start
    images = len(todo) * len(lobes.presets())
    if images:
        print(f"{images} images in {seconds:.1f} s: {images / seconds:.1f} a second; {len(partitions) - len(todo)} partitions were there")
    else:
        print("every partition was there")


if __name__ == "__main__":
    main()
