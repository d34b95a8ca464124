"""Reads the material off every picture of a set with Dask: partitions of pictures in, a Parquet file of answers a partition out.

    pip install dist/lobes-*.whl "dask[distributed]" pyarrow
    python examples/dask_classify.py IN OUT                      # two worker processes on this machine
    python examples/dask_classify.py IN OUT --scheduler tcp://…  # a cluster that is there already
    python examples/dask_classify.py IN OUT --processes 0        # this process alone: the same bytes

IN holds what examples/dask_training_set.py writes, or any Parquet files with a column `image`: square pictures of spheres that fill them,
linear RGB, row by row from the top, NaN outside of the sphere. Other columns are taken over. To them come the likeliest material (null for
none of these), its probability and that of none of these, and the 5 %, 50 % and 95 % quantiles of the roughness and of the specular share.

What is learned first, from the built-in light, lies in OUT/training.pickle, and each worker reads it once. An answer is written aside and renamed
when it is whole, so what is there is complete: start the command again and it does what is missing. A worker that dies costs the partition that it
was at, which Dask gives to another. OUT and IN lie where every worker sees them.
"""

import argparse
import functools
import os
import pathlib
import pickle
import sys
import time

import lobes
import numpy as np
import pyarrow as pa
import pyarrow.parquet

TRAINING = "training.pickle"
ENDS = ("low", "median", "high")


def write_whole(path, write):
    """Writes a file aside and renames it, and takes away what a worker that died left beside it."""
    for left_by_the_dead in path.parent.glob(f"{path.name}.*.part"):
        left_by_the_dead.unlink(missing_ok=True)
    aside = path.with_name(f"{path.name}.{os.getpid()}.part")
    write(aside)
    aside.replace(path)


def learn(out, lights, cameras):
    """Learns, unless an earlier run has."""
    path = pathlib.Path(out) / TRAINING
    if not path.exists():
        training = lobes.Training(lights, cameras=cameras)
        write_whole(path, lambda aside: aside.write_bytes(pickle.dumps(training)))


@functools.lru_cache(maxsize=1)
def model(out):
    return lobes.Model(pickle.loads((pathlib.Path(out) / TRAINING).read_bytes()), threads=False)


def answer(out, image):
    size = round((len(image) // 3) ** 0.5)
    pixels = np.nan_to_num(np.asarray(image, dtype=float).reshape(size, size, 3))
    try:
        verdict = model(out).read(lobes.Picture(pixels), circle=(size / 2, size / 2, size / 2))
    except ValueError as problem:
        return {"problem": str(problem)}
    return {
        "answer": verdict.material,
        "probability": max(verdict.probabilities.values()),
        "none": verdict.none,
        **{f"sigma_{end}": value for end, value in zip(ENDS, verdict.sigma)},
        **{f"share_{end}": value for end, value in zip(ENDS, verdict.share)},
    }


ANSWERS = pa.schema(
    [("answer", pa.string()), ("probability", pa.float64()), ("none", pa.float64())]
    + [(f"{what}_{end}", pa.float64()) for what in ("sigma", "share") for end in ENDS]
    + [("problem", pa.string())]
)


def classify_partition(source, out, name):
    """Reads one partition into a file of the same name and gives the name."""
    table = pa.parquet.read_table(pathlib.Path(source) / name)
    rows = [answer(out, image.values.to_numpy()) for image in table["image"]]
    answers = pa.Table.from_pylist(rows, ANSWERS)
    kept = [column for column in table.column_names if column != "image" and column not in ANSWERS.names]
    whole = table.select(kept)
    for field in ANSWERS:
        whole = whole.append_column(field, answers[field.name])
    write_whole(pathlib.Path(out) / name, lambda aside: pa.parquet.write_table(whole, aside, compression="zstd"))
    return name


def missing(source, out):
    names = sorted(path.name for path in pathlib.Path(source).glob("*.parquet"))
    return [name for name in names if not (pathlib.Path(out) / name).exists()]


def run(client, source, out, names):
    """The names of the partitions as they are done, by a Dask client or, where it is None, by this process."""
    if client is None:
        yield from (classify_partition(source, out, name) for name in names)
        return
    from dask.distributed import as_completed

    futures = [client.submit(classify_partition, source, out, name, key=f"classify-{name}", pure=False) for name in names]
    for future in as_completed(futures):
        yield future.result()


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("source", type=pathlib.Path, metavar="IN")
    options.add_argument("out", type=pathlib.Path, metavar="OUT")
    options.add_argument("--scheduler", help="the address of a Dask scheduler")
    options.add_argument("--processes", type=int, default=2, help="worker processes of a cluster of one's own; 0 for none")
    options.add_argument("--lights", nargs="*", help="names of built-in maps to learn from; all if none is named")
    options.add_argument("--cameras", type=int, default=8, help="how many cameras to learn from")
    options = options.parse_args()
    lights = {light.name: light for light in lobes.builtin()}
    if unknown := set(options.lights or ()) - set(lights):
        sys.exit(f"there is no light {', '.join(sorted(unknown))}; there are {', '.join(lights)}")
    if not list(options.source.glob("*.parquet")):
        sys.exit(f"{options.source} holds no Parquet file; examples/dask_training_set.py makes some")
    options.out.mkdir(parents=True, exist_ok=True)
    start = time.monotonic()
    learn(options.out, [lights[name] for name in options.lights or lights], options.cameras)
    print(f"learned in {time.monotonic() - start:.1f} s", file=sys.stderr)
    todo = missing(options.source, options.out)
    client = None
    if todo and (options.scheduler or options.processes):
        from dask.distributed import Client, LocalCluster

        client = Client(
            options.scheduler or LocalCluster(n_workers=options.processes, threads_per_worker=1, dashboard_address=None)
        )
    start = time.monotonic()
    for done, name in enumerate(run(client, str(options.source.resolve()), str(options.out.resolve()), todo), start=1):
        print(f"{done}/{len(todo)} {name}", file=sys.stderr)
    print(f"{len(todo)} partitions in {time.monotonic() - start:.1f} s")


if __name__ == "__main__":
    main()
