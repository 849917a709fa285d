"""Facts: records that code asks, words that people read."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from string import Formatter
from typing import Any

import pytest

from facefolds_core.facts import WORDS, fact, read_fact


def test_words_and_back() -> None:
    made = fact("frame_incomplete", frame="000006", cameras=[f"c{i}" for i in range(14)])
    value = json.loads(json.dumps(made.to_json()))
    words = "frame 000006: no image from " + ", ".join(made.values["cameras"][:12]) + " and 2 more"
    assert value["words"] == str(made) == words
    assert read_fact(value) == made and made.camera is None and fact("culled", camera="a").camera == "a"


@pytest.mark.parametrize(
    "value",
    [
        None,
        3,
        "a",
        [],
        {},
        *({"kind": kind} for kind in ("rumour", [], "culled")),
        {"kind": "gains", "r": 1, "g": 2, "b": 3},
    ],
)
def test_what_is_no_fact(value: Any) -> None:
    with pytest.raises(ValueError, match="fact"):
        read_fact(value)


def uses(root: Path) -> Iterator[tuple[str, ast.Call]]:
    """Every call of `fact`, with its file's name."""
    for path in (root / "facefolds_core").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "fact":
                yield path.name, node


def test_every_kind_is_used_and_every_use_is_a_kind(project_root: Path) -> None:
    """A typing error would show only when the fact is worded."""
    used: set[object] = set()
    for _, call in uses(project_root):
        used |= {c.value for c in ast.walk(call.args[0]) if isinstance(c, ast.Constant)}
    assert used | {"krt_is_scaled", "krt_is_of_full_size"} == set(WORDS)


def test_what_words_name_is_given_by_every_use(project_root: Path) -> None:
    """Braces that are meant literally are fields, too, unless they are doubled."""
    fields = {
        kind: {re.split(r"[.\[]", name)[0] for _, name, _, _ in Formatter().parse(text) if name}
        for kind, text in WORDS.items()
    }
    for file, call in uses(project_root):
        given = {keyword.arg for keyword in call.keywords}
        if isinstance(call.args[0], ast.Constant) and None not in given:
            assert fields[call.args[0].value] <= given, f"{file}: {call.args[0].value}"
