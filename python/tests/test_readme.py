"""Every piece of Python in the README runs."""

import pathlib
import re

import pytest

README = (pathlib.Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
PIECES = re.findall(r"^```python\n(.*?)^```", README, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("piece", PIECES, ids=range(len(PIECES)))
def test_the_readme_runs(piece, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(piece, "README.md", "exec"), {"__name__": "readme"})


def test_there_are_some():
    assert len(PIECES) == 6
