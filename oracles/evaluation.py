"""Wilson's interval by SciPy; nearest neighbour with whole groups left out by scikit-learn."""

import numpy as np
from scipy.stats import binomtest
from sklearn.model_selection import LeaveOneGroupOut
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, StandardScaler
from snapshot import Snapshot

snapshot = Snapshot(__file__, oracle=["scipy", "scikit-learn", "numpy"], precision="double", tolerance=1e-13)

for successes, trials in [(0, 1), (1, 1), (0, 10), (10, 10), (1, 3), (68, 72), (36, 68), (219, 224), (1, 10**6), (50_000, 100_001)]:
    for level in (0.5, 0.9, 0.95, 0.999):
        ends = binomtest(successes, trials).proportion_ci(level, "wilson")
        snapshot.case("wilson", successes=successes, trials=trials, level=level, low=ends.low, high=ends.high)

# Ten features as the paper's: positive, over decades, the seventh a degree that may be 0; six labels under eight lights, overlapping.
LABELS, GROUPS = 6, 8
random = np.random.Generator(np.random.PCG64(20))
centres = random.normal(size=(LABELS, 10))
labels = np.repeat(np.arange(LABELS), GROUPS)
groups = np.tile(np.arange(GROUPS), LABELS)
features = np.exp(1.5 * (centres[labels] + 0.7 * random.normal(size=(len(labels), 10)) + 0.5 * random.normal(size=(GROUPS, 10))[groups]))
features[:, 6] = np.floor(10 * features[:, 6]) % 40
features[0, 6] = 0.0


def logarithm(x):
    y = x.copy()
    y[:, 6] += 1.0
    return np.log(y)


SCALINGS = {
    "none": [],
    "standardised": [StandardScaler()],
    "logarithmic": [FunctionTransformer(logarithm)],
    "logarithmic-standardised": [FunctionTransformer(logarithm), StandardScaler()],
}
for name, steps in SCALINGS.items():
    said, nearest = np.zeros(len(labels), dtype=int), np.zeros(len(labels))
    for training, test in LeaveOneGroupOut().split(features, labels, groups):
        model = make_pipeline(*steps, KNeighborsClassifier(1, algorithm="brute"))
        model.fit(features[training], labels[training])
        said[test] = model.predict(features[test])
        scaled = model[:-1].transform(features[test]) if steps else features[test]
        nearest[test] = model[-1].kneighbors(scaled)[0][:, 0]
    assert 0.4 < np.mean(said == labels) < 0.99
    snapshot.case(
        "nearest-neighbour", scaling=name, features=features, labels=labels, groups=groups, label_count=LABELS,
        said=said, nearest=nearest,
    )  # fmt: skip
snapshot.write()
