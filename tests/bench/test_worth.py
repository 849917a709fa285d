"""Mechanisms are switched off by names that are there, and on again; the table tells differences."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench.results import Store
from bench.run import chosen
from bench.worth import MECHANISMS, Off, Worth, patched, table
from facefolds_core.errors import UserError
from facefolds_core.params import ExplicitParams, merged
from facefolds_core.training.explicit import state


@pytest.mark.parametrize("off", MECHANISMS.values(), ids=list(MECHANISMS))
def test_what_is_switched_off_is_there(off: Off) -> None:
    """Unknown keys of `train` are refused, and so are unknown names of the code."""
    usual = ExplicitParams()
    changed = ExplicitParams.model_validate(merged(usual.model_dump(), off.params))
    assert (changed != usual) == bool(off.params)
    with patched(off.code):
        pass


def test_it_is_switched_on_again_even_after_an_error() -> None:
    before = state.BELIEF
    with pytest.raises(ZeroDivisionError), patched({"facefolds_core.training.explicit.state:BELIEF": 0.0}):
        assert state.BELIEF == 0
        raise ZeroDivisionError
    assert before == state.BELIEF > 0


def test_the_table_tells_what_a_loss_costs(tmp_path: Path) -> None:
    store = Store(tmp_path / "worth.json", "worth", Worth)
    scores = {"any": 30.0, "inside": 32.0, "band": 20.0, "moving": None}
    store.add(Worth(capture="actor", without="nothing", scores=scores))
    store.add(Worth(capture="actor", without="reflection", scores={**scores, "any": 29.5}))
    rows = table(store, ["actor"]).splitlines()
    assert "| nothing | 30.00 / 32.00 / 20.00 / - |" in rows
    assert "| reflection | -0.50 / +0.00 / +0.00 / - |" in rows


def test_unknown_names_are_refused() -> None:
    with pytest.raises(UserError, match="no such name"):
        chosen("actor; mugsi", ["actor", "mugsy"], "--only")
    assert chosen("", ["actor", "mugsy"], "--only") == ["actor", "mugsy"]
