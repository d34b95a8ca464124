"""Errors of pictures of balls, by their definitions: mpmath, and NumPy's percentiles on a whole frame.

Pictures are made from a seed (`uniform`): of each pixel of a square six numbers, three for the truth and three for the estimate. A pixel
whose first number is below -0.8 is black in the truth, one whose fourth is below -0.9 black in the estimate. Only the pixels whose
centres lie in the unit disc show the ball.
"""

import mpmath
import numpy as np
from mpmath import mpf
from snapshot import Snapshot, uniform

mpmath.mp.dps = 40
snapshot = Snapshot(__file__, oracle=["mpmath", "numpy"], precision="40 digits; percentiles in double", tolerance=1e-13)


def pictures(seed, size):
    """Truth and estimate on the ball, as lists of colours."""
    numbers = uniform(seed, 6 * size * size)
    truth, estimate = [], []
    for index in range(size * size):
        row, column = divmod(index, size)
        x, y = (2 * column + 1) / size - 1, 1 - (2 * row + 1) / size
        if x * x + y * y >= 1:
            continue
        of = numbers[6 * index : 6 * index + 6]
        t = [(1 + u) * (1 + u) * (1 + u) for u in of[:3]]
        e = [value * (1.5 + u) for value, u in zip(t, of[3:])]
        truth.append([0.0] * 3 if of[0] < -0.8 else t)
        estimate.append([0.0] * 3 if of[3] < -0.9 else e)
    return truth, estimate


def total(values):
    return mpmath.fsum(values)


def degrees(t, e):
    t, e = [mpf(v) for v in t], [mpf(v) for v in e]
    if not any(t) or not any(e):
        return None
    cross = [t[1] * e[2] - t[2] * e[1], t[2] * e[0] - t[0] * e[2], t[0] * e[1] - t[1] * e[0]]
    return mpmath.degrees(mpmath.atan2(mpmath.sqrt(total(v * v for v in cross)), total(a * b for a, b in zip(t, e))))


for seed, size in [(901, 8), (902, 16), (903, 33)]:
    truth, estimate = pictures(seed, size)
    t, e = [mpf(v) for p in truth for v in p], [mpf(v) for p in estimate for v in p]
    count = len(truth)
    apart = total((b - a) ** 2 for a, b in zip(t, e))
    scale = total(a * b for a, b in zip(t, e)) / total(b * b for b in e)
    scaled = total((scale * b - a) ** 2 for a, b in zip(t, e))
    energy = total(a * a for a in t)
    angles = [angle for a, b in zip(truth, estimate) if (angle := degrees(a, b)) is not None]
    assert len(angles) < count
    mean = mpmath.sqrt(apart / (3 * count))
    errors = {
        "relative-rmse": mpmath.sqrt(apart / energy),
        "relative-si-rmse": mpmath.sqrt(scaled / energy),
        "angle": total(angles) / len(angles),
        "summed-rmse": mpmath.sqrt(apart / count),
        "summed-si-rmse": mpmath.sqrt(scaled / count),
        "angle-black-is-0": total(angles) / count,
        "mean-rmse": mean,
        "mean-si-rmse": mpmath.sqrt(scaled / (3 * count)),
        "psnr": 20 * mpmath.log10(max(*t, *e) / mean),
    }
    for name, value in errors.items():
        snapshot.case("error", seed=seed, size=size, measure=name, value=float(value))

# A frame of which the ball fills 12.14 %, black about it.
for seed, size in [(904, 128), (905, 200)]:
    truth, estimate = (np.array(picture) for picture in pictures(seed, size))
    count = len(truth)
    frame = round(count / 0.1214)

    def normalised(picture):
        whole = np.zeros((frame, 3))
        whole[:count] = picture
        low, high = np.percentile(whole, [0.01, 99.9])
        return (picture - low) / (high - low)

    error = np.sqrt(np.sum((normalised(estimate) - normalised(truth)) ** 2) / count)
    snapshot.case("normalised", seed=seed, size=size, value=float(error))
snapshot.write()
