"""The notebook of the documents, as it is saved, is small and of no machine; test_lines runs its cells."""

from __future__ import annotations

import json
import re

from docs.tools.notebook import NOTEBOOK, output, read


def test_every_cell_has_been_executed_in_order() -> None:
    cells = [cell for cell in read()["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    assert all(len(cell["outputs"]) == 1 for cell in cells)


def test_it_is_small_and_names_no_machine() -> None:
    text = NOTEBOOK.read_text(encoding="utf-8")
    assert len(text) < 300_000
    shown = [json.dumps(cell.get("outputs", [])) for cell in read()["cells"]]
    words = [re.sub(r'"image/\w+": "[^"]*"', "", one) for one in shown]
    assert not [one for one in words if re.search(r"/(tmp|home|root|work|Users|private)\b", one)]


def test_what_is_too_large_is_left_out() -> None:
    class Large:
        def _repr_html_(self) -> str:
            return "x" * 200_000

        def _repr_png_(self) -> bytes:
            return b"png"

    assert set(output(Large(), 1)["data"]) == {"text/plain", "image/png"}
