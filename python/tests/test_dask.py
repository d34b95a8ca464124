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


def test_classifying_survives_a_killed_worker_too(tmp_path):
    classify = pytest.importorskip("dask_classify")
    source, alone, cluster_out = tmp_path / "in", tmp_path / "alone", tmp_path / "cluster"
    for folder in (source, alone, cluster_out):
        folder.mkdir()
    list(training_set.run(None, str(source), PARTITIONS, SIZE, TOLERANCE))
    classify.learn(alone, list(training_set.lights().values())[:2], cameras=2)
    (cluster_out / classify.TRAINING).write_bytes((alone / classify.TRAINING).read_bytes())
    names = classify.missing(source, alone)
    assert len(names) == len(PARTITIONS)
    list(classify.run(None, str(source), str(alone), names))
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        client.run(sys.path.insert, 0, sys.path[0])
        workers = list(client.run(os.getpid).values())
        done = classify.run(client, str(source), str(cluster_out), names)
        next(done)
        os.kill(workers[0], signal.SIGKILL)
        list(done)
    assert read(cluster_out) == read(alone)
    assert classify.missing(source, cluster_out) == []
    table = pyarrow.parquet.read_table(alone / names[0])
    assert table.num_rows == 8 and table["problem"].null_count == 8
    assert "image" not in table.column_names and table["material"][0].as_py()
