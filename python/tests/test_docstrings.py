"""The docstrings: numpydoc's form, the parameters that there are, and examples that run."""

import doctest
import inspect
import re

import lobes
import pytest
from test_arguments import RECORDS, public

PUBLIC = [name for name in public() if not name.split(".")[-1].startswith("_")] + ["Rendering.write"]
# They make a value of parts, as their class says, or have no argument.
NAMES = re.compile(r"^(\w+(?:, \w+)*) : ", re.MULTILINE)


def find(name):
    value = lobes
    for part in name.split("."):
        value = getattr(value, part)
    return value


def sections(doc):
    """The text above the first section, and each section by its title."""
    parts = re.split(r"^(\w+)\n-+\n", inspect.cleandoc(doc), flags=re.MULTILINE)
    return parts[0], dict(zip(parts[1::2], parts[2::2]))


def parameters(value):
    """The names that a call takes; none of a class that is made by others."""
    try:
        signature = inspect.signature(value)
    except ValueError:
        return []
    return [name for name in signature.parameters if name not in ("self", "cls")]


@pytest.mark.parametrize("name", PUBLIC)
def test_the_form(name):
    value = find(name)
    summary, parts = sections(value.__doc__)
    assert summary.strip() and summary.strip().split("\n\n")[0].endswith((".", ":", "…"))
    expected = [title for title in ("Parameters", "Returns", "Examples") if title in parts]
    assert list(parts) == expected and "Examples" in parts
    names = [one for line in NAMES.findall(parts.get("Parameters", "")) for one in line.split(", ")]
    assert names == parameters(value)
    if not isinstance(value, type) and name not in ("write_exr", "write_png", "Rendering.write"):
        assert "Returns" in parts


@pytest.mark.parametrize("name", PUBLIC)
def test_the_examples_run(name):
    doc = inspect.cleandoc(find(name).__doc__)
    test = doctest.DocTestParser().get_doctest(doc, {}, name, None, None)
    assert test.examples
    failures = []
    doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, out=failures.append)
    assert not failures, "".join(failures)


def test_what_is_no_call_is_described():
    for name in lobes.__all__:
        value = getattr(lobes, name)
        if not isinstance(value, type):
            continue
        assert value.__doc__, name
        for inner, attribute in vars(value).items():
            # Fields of records have theirs in the source.
            data = inspect.isdatadescriptor(attribute) and name not in RECORDS | {"Coefficients"}
            assert not data or inner.startswith("_") or attribute.__doc__, f"{name}.{inner}"
