"""JSON and YAML that is no JSON or YAML of ours: one clear message, whatever it is."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from facefolds_core.errors import UserError
from facefolds_core.files.parsing import MAX_DEPTH, brief, parse_json, parse_yaml
from facefolds_core.files.writing import read_json, write_json

DIGITS = "9" * 5000


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (DIGITS, "too large"),
        ("[" + "9" * 25 + "]", "too large"),
        ("9223372036854775808", "too large"),
        ("[" * 100_000, "too deeply"),
        ("[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1), "too deeply"),
        ('{"a":' * 100_000, "too deeply"),
        ('{"a": 1, "a": 2}', "given twice"),
        ("{", "line 1"),
        ("", "line 1"),
        ("{\n 1}", "line 2"),
        ('{"a": "\xff"}', "byte 7"),
    ],
)
def test_json(text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(UserError, match=says) as caught:
        read_json(path)
    assert str(path) in str(caught.value)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("text", ["9223372036854775807", "[" * MAX_DEPTH + "]" * MAX_DEPTH, '{"a": 1e300}', "-1", '""'])
def test_sound_json(text: str) -> None:
    assert parse_json(text, "a.json", "") == json.loads(text)


def test_what_is_written_is_read_and_nan_is_never_written(tmp_path: Path) -> None:
    value = {"a": [1, 2.5, None, "ä"]}
    write_json(tmp_path / "a.json", value)
    assert read_json(tmp_path / "a.json") == json.loads((tmp_path / "a.json").read_text()) == value
    with pytest.raises(ValueError):
        write_json(tmp_path / "b.json", {"psnr": float("nan")})
    with pytest.raises(UserError, match="file not found"):
        read_json(tmp_path / "b.json")


LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [{', '.join([f'*{a}'] * 10)}]\n" for a, b in zip("abcdefg", "bcdefgh", strict=True)
)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a: 99999999999999999999", "too large"),
        ("a: 0x" + "f" * 30, "too large"),
        ("[" * 3000, "too deeply"),
        ("[" * 80 + "]" * 80, "too deeply"),
        ("a: 1\nb: 2\na: 3\n", "given twice"),
        ("s: {a: {x: 1}, a: {x: 2}}", "line 1, column 16"),
        (LAUGHS, "too many values"),
        ("a: &a [*a]", "what it stands in"),
        ("a: *b", "line 1"),
        *((f"a: {x}", "not of its type") for x in (DIGITS, "2024-13-45")),
        *((f"a: !!{kind} x", "not of its type") for kind in ("int", "float", "bool", "timestamp")),
        *((f"a: {x}", "garbled YAML") for x in ("!!python/object/apply:os.system [ls]", "!mine 3", "\x01")),
        *((x, "garbled YAML") for x in ("? [a]\n: b", "--- a\n--- b\n")),
    ],
)
def test_yaml(text: str, says: str) -> None:
    with pytest.raises(UserError, match=says) as caught:
        parse_yaml(text, "params.yaml", "mend it")
    assert "params.yaml" in str(caught.value)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("", None),
        ("a: &x {b: 1}\nc: *x\nd: {<<: *x, e: 2}", {"a": {"b": 1}, "c": {"b": 1}, "d": {"b": 1, "e": 2}}),
        ("a: [1, 2.5, yes, ~, '1']", {"a": [1, 2.5, True, None, "1"]}),
    ],
)
def test_sound_yaml(text: str, value: object) -> None:
    assert parse_yaml(text, "params.yaml", "") == value


def test_what_cannot_be_shown_is_said_in_short() -> None:
    assert "int" in brief(10**5000)
    assert brief("x" * 1000).endswith("...") and len(brief("x" * 1000)) == 100
