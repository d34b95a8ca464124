"""Every piece of Python in the README and in the gallery runs, and shows the picture that stands beneath it."""

import pathlib
import re

import lobes
import numpy as np
import pytest
from notebook import run

PYTHON = pathlib.Path(__file__).parents[1]
DOCUMENTS = [PYTHON / "README.md", PYTHON.parent / "docs" / "gallery.md"]


def codes(path):
    picture = lobes.Picture.read(path)
    return lobes.srgb_of_linear(picture.pixels * (1 if picture.mask is None else picture.mask[..., None]))


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.stem)
def test_the_pieces_run(document, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pictures = run(document)
    assert len(pictures) >= 5
    for name, data in pictures:
        path = document.parent / name
        if name.endswith(".png"):
            fresh = tmp_path / "fresh.png"
            fresh.write_bytes(data)
            # Processors round differently.
            assert np.abs(codes(fresh) - codes(path)).max() < 0.02, name
        else:
            form, committed = (re.sub(r"[\d.]+", "", text) for text in (data.decode(), path.read_text(encoding="utf-8")))
            assert form == committed, name
