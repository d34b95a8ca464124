"""What the oracles of peers share: numbers by seed, the name of a source, and some of many answers."""

import importlib.metadata

import numpy as np
from snapshot import uniform

seeds = iter(range(5000, 10**6))


def source(package, test, function):
    return f"{package} {importlib.metadata.version(package)}, {test}: {function}"


def random(*shape, seed=None):
    return np.array(uniform(next(seeds) if seed is None else seed, int(np.prod(shape)))).reshape(shape)


def pairs(values):
    values = np.asarray(values)
    return np.stack([values.real, values.imag], axis=-1)


def some(values, count=16):
    """Which of many values are kept, and these."""
    values = np.asarray(values).ravel()
    shown = np.unique(np.linspace(0, values.size - 1, count).astype(int))
    return {"shown": shown, "values": pairs(values[shown]) if np.iscomplexobj(values) else values[shown]}
