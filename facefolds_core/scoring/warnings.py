"""What is not well with a result, from all that the stages have noticed: each in words that say what to do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from facefolds_core.facts import WARNINGS, Fact, fact, read_fact
from facefolds_core.files.reading import is_there
from facefolds_core.files.writing import read_json
from facefolds_core.params import ScoreWarningParams
from facefolds_core.scoring.temporal import Change


def stands_still(changes: Mapping[str, Change], frames: int, params: ScoreWarningParams) -> list[Fact]:
    """A fact where little of what changes from frame to frame is shown.

    Args:
        changes: by variant.
        frames: of the scene.
    """
    asset, model = changes.get("asset"), changes.get("model")
    if asset is None or model is None or asset.temporal is None or model.temporal is None:
        return []
    moves = frames >= params.min_frames and (asset.truth_change or 0.0) >= params.min_change
    if not moves or asset.temporal >= params.min_temporal:
        return []
    return [fact("stands_still", asset=asset.temporal, model=model.temporal, under=params.min_temporal)]


def training_events(fit: Path) -> list[Fact]:
    """What happened to a training, from its fit.json; nothing where it has none, and what is no fact is left out."""
    if not is_there(fit):
        return []
    value: Any = read_json(fit, remedy="run `dvc repro`: the stage train will run again")
    events = value.get("events") if isinstance(value, dict) else None
    found = []
    for event in events if isinstance(events, list) else []:
        try:
            found.append(read_fact(event))
        except ValueError:
            continue
    return found


def warnings_among(facts: Sequence[Fact]) -> tuple[Fact, ...]:
    """Those that ask for something to be done, each once."""
    return tuple({str(one): one for one in facts if one.kind in WARNINGS}.values())
