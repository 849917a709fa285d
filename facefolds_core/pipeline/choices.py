"""The record of what `auto` chose, in the folder of the stage that chose it."""

from __future__ import annotations

from pathlib import Path

from facefolds_core.facts import Fact
from facefolds_core.files.writing import write_json

CHOICE = "choice.json"


def write_choice(folder: Path, why: Fact | None) -> str:
    """Write `choice.json` of a stage's folder: what `auto` chose, and why. Returns the line that says it, or ""."""
    if why is None:
        return ""
    write_json(folder / CHOICE, why.to_json())
    return f"\n  {why}"
