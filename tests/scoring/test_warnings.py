"""What is said not to be well."""

from __future__ import annotations

from pathlib import Path

import pytest

from facefolds_core.facts import fact
from facefolds_core.files.writing import write_json
from facefolds_core.pipeline.evaluate import stands_still, training_events, warnings_among
from facefolds_core.scoring.temporal import Change


@pytest.mark.parametrize(
    ("explained", "frames", "moves", "said"),
    [
        (0.1, 8, 0.05, True),
        (0.3, 8, 0.05, False),  # it moves
        (0.1, 7, 0.05, False),  # too few frames to tell
        (-0.5, 60, 0.001, False),  # nothing but noise changes
        (None, 60, 0.0, False),
    ],
)
def test_a_film_that_stands_still_is_named(explained: float | None, frames: int, moves: float, said: bool) -> None:
    change = Change(explained, 20.0, 0.01, moves)
    found = stands_still({"model": change, "asset": change}, frames)
    assert [one.kind for one in found] == (["stands_still"] if said else [])
    assert all("train.iterations" in str(one) for one in found)


def test_notes_for_the_record_are_no_warnings_and_nothing_is_said_twice() -> None:
    culled = fact("culled", camera="a", elevation=60.0, azimuth=0.0)
    found = warnings_among([culled, fact("front_is_guessed"), fact("front_is_guessed")])
    assert [one.kind for one in found] == ["front_is_guessed"]


def test_what_happened_in_training_is_read_and_what_is_no_fact_left_out(tmp_path: Path) -> None:
    write_json(
        tmp_path / "fit.json", {"events": [fact("front_is_guessed").to_json(), {"kind": "of tomorrow"}, "words"]}
    )
    assert [one.kind for one in training_events(tmp_path / "fit.json")] == ["front_is_guessed"]
    assert training_events(tmp_path / "none.json") == []
