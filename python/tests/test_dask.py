"""The Dask examples: a worker killed midway costs nothing but time."""

import os
import pathlib
import signal
import sys

import pyarrow.parquet
import pytest

distributed = pytest.importorskip("dask.distributed")
sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "examples"))
training_set = pytest.importorskip("dask_training_set")

PARTITIONS = [(light, azimuth, 0.0) for light in list(training_set.lights())[:2] for azimuth in (0.0, 120.0, 240.0)]
SIZE, TOLERANCE = 24, 1e-2


def read(folder):
    assert not list(folder.glob("*.part"))
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_killed_worker_changes_no_byte(tmp_path):
    alone, cluster_out = tmp_path / "alone", tmp_path / "cluster"
    for folder in (alone, cluster_out):
        folder.mkdir()
    list(training_set.run(None, str(alone), PARTITIONS, SIZE, TOLERANCE))
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        # A worker imports the example by its name.
        client.run(sys.path.insert, 0, sys.path[0])
        workers = list(client.run(os.getpid).values())
        done = training_set.run(client, str(cluster_out), PARTITIONS, SIZE, TOLERANCE)
        next(done)
        os.kill(workers[0], signal.SIGKILL)
        list(done)
    assert read(cluster_out) == read(alone)
    assert training_set.missing(cluster_out, PARTITIONS) == []


def test_what_is_missing_is_done_again(tmp_path):
    list(training_set.run(None, str(tmp_path), PARTITIONS[:2], SIZE, TOLERANCE))
    before = read(tmp_path)
    (tmp_path / training_set.partition_name(PARTITIONS[0])).unlink()
    assert training_set.missing(tmp_path, PARTITIONS[:2]) == PARTITIONS[:1]
    list(training_set.run(None, str(tmp_path), PARTITIONS[:1], SIZE, TOLERANCE))
    assert read(tmp_path) == before
    table = pyarrow.parquet.read_table(tmp_path / training_set.partition_name(PARTITIONS[0]))
    assert table.num_rows == 8 and len(table["image"][0]) == 3 * SIZE * SIZE
