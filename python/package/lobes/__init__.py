"""Reflectance in the frequency domain.

Arrays are NumPy's, of doubles; directions are unit vectors in the last dimension of 3. Harmonics are real, orthonormal,
without the Condon–Shortley phase; coefficients are stored by order m: for each m the degrees l = m … degree, first of cos mφ,
then, for m > 0, of sin mφ. `to_complex` and `from_complex` are the form of healpy and ducc0.
"""

from ._lobes import (
    Camera,
    EnvironmentMap,
    Lobe,
    Material,
    Model,
    Picture,
    Renderer,
    Rotation,
    Training,
    Transform,
    Verdict,
    average_power,
    basis,
    builtin,
    features,
    from_complex,
    lambert,
    presets,
    synthesise_at,
    to_complex,
    vectors,
)

FEATURE_NAMES = ("v1", "v2", "v3", "v4", "v5", "v6", "v7", "red", "green", "blue")
VARIANTS = ("ward1992", "duer", "gmd", "sampled")

__all__ = [
    "Camera",
    "EnvironmentMap",
    "FEATURE_NAMES",
    "Lobe",
    "Material",
    "Model",
    "Picture",
    "Renderer",
    "Rotation",
    "Training",
    "Transform",
    "VARIANTS",
    "Verdict",
    "average_power",
    "basis",
    "builtin",
    "features",
    "from_complex",
    "lambert",
    "presets",
    "synthesise_at",
    "to_complex",
    "vectors",
]
