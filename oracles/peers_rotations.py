"""As peers.py, of two libraries that bring more than a gigabyte with them: e3nn (PyTorch) and spherical (Numba). Where they are missing this is skipped.

e3nn's polar axis is y: its vectors (x, y, z), and its quaternions (x, y, z, w), are (z, x, y) and (z, x, y, w) of ours; its matrices act on
real coefficients, m from −l to l. Its normalisations "integral", "component" and "norm" are ours of 1, 4π and Schmidt. spherical's quaternions
are (w, x, y, z) and its D is the conjugate of ours.
"""

import numpy as np
from peers_tools import random, some, source
from snapshot import Snapshot, skip

try:
    import quaternionic
    import spherical
    import torch
    from e3nn import o3
except ImportError:
    skip("e3nn and spherical are not there: install e3nn==0.6.0 and spherical==1.1.4 into the oracles' environment by pip")

torch.set_default_dtype(torch.float64)
snapshot = Snapshot(__file__, oracle=["e3nn", "spherical"], precision="double", tolerance=1e-12)

for degree in (1, 2, 3, 5, 8):
    vectors = random(5, 3)
    for theirs, ours in [("integral", "ortho"), ("component", "4pi"), ("norm", "schmidt")]:
        table = o3.spherical_harmonics(degree, torch.tensor(vectors), normalize=True, normalization=theirs).numpy()
        for order in (-degree, degree - 1):
            values = table[:, degree + order]
            snapshot.case(
                "harmonic", source=source("e3nn", "tests/o3/cartesian_spherical_harmonics_test.py", "o3.spherical_harmonics"), kind="real",
                normalisation=ours, condon_shortley=False, degree=degree, order=order, directions=vectors[:, [2, 0, 1]],
                values=np.stack([values, 0 * values], axis=-1),
            )  # fmt: skip
for degree in (1, 2, 4, 8):
    for _ in range(2):
        quaternion = random(4)
        x, y, z, w = quaternion / np.linalg.norm(quaternion)
        angles = o3.matrix_to_angles(o3.quaternion_to_matrix(torch.tensor([w, x, y, z])))
        matrix = o3.wigner_D(degree, *angles).numpy()
        snapshot.case("real-d", source=source("e3nn", "tests/o3/rotation_test.py", "o3.wigner_D"), degree=degree, quaternion=[z, x, y, w], **some(matrix, 32))
for degree in (1, 2, 6, 16):
    wigner = spherical.Wigner(degree)
    orders = range(-degree, degree + 1)
    for beta in np.pi * (1 + random(3)):
        d = wigner.d(np.exp(1j * beta))
        matrix = np.array([[d[wigner.dindex(degree, row, column)] for column in orders] for row in orders])
        snapshot.case("small-d", source=source("spherical", "tests/test_wigner_D.py", "Wigner.d"), degree=degree, beta=beta, **some(matrix, 32))
        quaternion = random(4)
        x, y, z, w = quaternion / np.linalg.norm(quaternion)
        d = wigner.D(quaternionic.array(w, x, y, z))
        matrix = np.array([[d[wigner.Dindex(degree, row, column)] for column in orders] for row in orders])
        snapshot.case("large-d", source=source("spherical", "tests/test_wigner_D.py", "Wigner.D"), degree=degree, quaternion=[x, y, z, w], **some(matrix, 32))
snapshot.write()
