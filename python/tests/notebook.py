"""Runs the pieces of Python of a document as the cells of a notebook, and keeps what it shows of their last lines.

    python notebook.py DOCUMENT…      writes each picture to where the document has it
"""

import ast
import pathlib
import re
import sys

CELL = re.compile(r"^```python\n(.*?)^```|^!\[[^\]]*\]\(([^)]+)\)", re.MULTILINE | re.DOTALL)


def shown(value):
    """The file's ending and its bytes: an object's picture, or its SVG."""
    if hasattr(value, "_repr_png_"):
        return ".png", value._repr_png_()
    return ".svg", value._repr_html_().encode()


def run(document):
    """Runs every piece, in one namespace: pairs of a picture's name, as the document has it, and its bytes."""
    namespace, last, pictures = {"__name__": "notebook"}, None, []
    for code, picture in CELL.findall(document.read_text(encoding="utf-8")):
        if code:
            body = ast.parse(code, document.name)
            value = ast.Expression(body.body.pop().value) if isinstance(body.body[-1], ast.Expr) else None
            exec(compile(body, document.name, "exec"), namespace)
            last = None if value is None else eval(compile(value, document.name, "eval"), namespace)
        else:
            ending, data = shown(last)
            assert picture.endswith(ending), f"{picture} is not {ending}"
            pictures.append((picture, data))
    return pictures


if __name__ == "__main__":
    for name in sys.argv[1:]:
        document = pathlib.Path(name)
        for picture, data in run(document):
            path = document.parent / picture
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
            print(f"{path}: {len(data)} bytes")
