"""Execute the notebook of the documents and write what its cells show into it: `python -m docs.tools.notebook`.

Run it when the API or the notebook's cells change, with the player built (`make view`).
"""

from __future__ import annotations

import ast
import base64
import json
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import chdir, redirect_stderr
from pathlib import Path
from typing import Any

NOTEBOOK = Path(__file__).resolve().parents[1] / "guide" / "python.ipynb"
MOST = 120_000
"""Characters of an output. The player is larger: GitHub would not show it, and its poster stands for it."""
SHOWN = {"text/html": "_repr_html_", "image/png": "_repr_png_", "image/jpeg": "_repr_jpeg_"}
"""Kind of output -> the method of an object that gives it; the first that is small enough is saved."""


def read() -> dict[str, Any]:
    """The notebook as JSON (nbformat 4.5)."""
    notebook: dict[str, Any] = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    return notebook


def run(
    notebook: dict[str, Any], folder: Path, names: dict[str, Any] | None = None
) -> Iterator[tuple[dict[str, Any], Any]]:
    """Execute the code cells one after the other, as a notebook does.

    Args:
        folder: that they run in; it is the working directory until the last one has been taken.
        names: gets what the cells define.

    Yields:
        each code cell, and the value of its last line; None where that is no expression.
    """
    names = {} if names is None else names
    names["__name__"] = "__main__"
    with chdir(folder):
        for cell in notebook["cells"]:
            if cell["cell_type"] == "code":
                lines = ast.parse("".join(cell["source"]))
                last = lines.body[-1]
                shown = ast.Expression(last.value) if isinstance(last, ast.Expr) else None
                exec(compile(ast.Module(lines.body[: -1 if shown else None], []), cell["id"], "exec"), names)
                yield cell, None if shown is None else eval(compile(shown, cell["id"], "eval"), names)


def output(value: Any, count: int) -> dict[str, Any]:
    """What a cell shows of a value."""
    words = re.sub(r" at 0x[0-9A-Fa-f]+", "", repr(value))
    data: dict[str, Any] = {"text/plain": words.splitlines(keepends=True)}
    for kind, method in SHOWN.items():
        shown = getattr(value, method, lambda: None)()
        if isinstance(shown, bytes):
            shown = base64.b64encode(shown).decode()
        if shown is not None and len(shown) <= MOST:
            data[kind] = shown.splitlines(keepends=True) if kind == "text/html" else shown
            break
    return {"output_type": "execute_result", "execution_count": count, "metadata": {}, "data": data}


def main() -> None:
    notebook = read()
    with tempfile.TemporaryDirectory() as folder, Path(os.devnull).open("w") as nowhere, redirect_stderr(nowhere):
        for count, (cell, value) in enumerate(run(notebook, Path(folder)), 1):
            cell["execution_count"] = count
            cell["outputs"] = [] if value is None else [output(value, count)]
    NOTEBOOK.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
