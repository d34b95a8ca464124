"""Rotated coefficients by ducc0, checked here by healpy and by the rotated field itself.

The rotation is active: the field g with g(R x) = f(x), R the matrix of the unit quaternion (x, y, z, w).
Coefficients that go in are made from a seed (`uniform`) in the order l² + l + m.
"""

import numpy as np
from convention import degrees_and_orders, to_complex, to_real
from snapshot import Snapshot, uniform

import ducc0
import healpy
from scipy.spatial.transform import Rotation
from scipy.special import sph_harm_y

# (ψ, θ, φ) of R = Rz(φ) Ry(θ) Rz(ψ): general, about the pole, half a turn over, nearly nothing, nearly over, general.
EULER = [(0.3, 1.1, -2.0), (0.7, 0.0, 0.0), (0.0, np.pi, 0.4), (1e-9, 1e-8, 0.0), (2.0, 3.1415, -1.0), (-2.5, 1.6, 3.0)]


def rotate(real, degree, psi, theta, phi):
    alm = to_complex(real, degree)
    ours = ducc0.sht.rotate_alm(alm, degree, psi, theta, phi)
    theirs = alm.copy()
    healpy.rotate_alm(theirs, psi, theta, phi)
    assert np.abs(ours - theirs).max() < 1e-12 * degree, "ducc0 and healpy disagree"
    return to_real(ours, degree)


def field(real, degree, directions):
    l, m = degrees_and_orders(degree)
    theta = np.arctan2(np.hypot(directions[:, 0], directions[:, 1]), directions[:, 2])[:, None]
    phi = np.arctan2(directions[:, 1], directions[:, 0])[:, None]
    values = sph_harm_y(l, np.abs(m), theta, phi)
    scale = np.where(m == 0, 1.0, np.sqrt(2) * (-1.0) ** np.abs(m))
    return (scale * np.where(m < 0, values.imag, values.real)) @ np.asarray(real)


snapshot = Snapshot(__file__, oracle=["ducc0", "healpy", "scipy"], precision="double", tolerance=1e-12)
for seed, angles in enumerate(EULER, start=400):
    quaternion = Rotation.from_euler("ZYZ", [angles[2], angles[1], angles[0]])
    for degree, kept in ((12, slice(None)), (128, slice(-257, None))):
        real = uniform(seed, (degree + 1) ** 2)
        rotated = rotate(real, degree, *angles)
        if degree == 12:
            points = np.array(uniform(seed + 50, 60)).reshape(20, 3)
            points /= np.linalg.norm(points, axis=1)[:, None]
            off = field(rotated, degree, quaternion.apply(points)) - field(real, degree, points)
            assert np.abs(off).max() < 1e-11, f"the sense of the rotation is misread: {np.abs(off).max()}"
        name = "all" if degree == 12 else "highest-degree"
        snapshot.case(name, degree=degree, seed=seed, quaternion=quaternion.as_quat(), coefficients=rotated[kept])
snapshot.write()
