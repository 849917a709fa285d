"""Two jobs with a stage in common may lose DVC's record of it to each other: the stage is then run again."""

from __future__ import annotations

from facefolds_core.cluster.job import ATTEMPTS, repro

LOST = "ERROR: failed to reproduce 'configure': [Errno 2] No such file: '/p/.dvc/cache/runs/47/475c/.4sh.tmp'\n"
DAMAGED = "WARNING: corrupted cache file '../cache/runs/47/475c/.4sh.tmp'.\nERROR: failed: 'evaluate@bad'\n"


def _repro(*answers: tuple[int, str]) -> tuple[int, str, int]:
    left = list(answers)
    status, log = repro(lambda *_: left.pop(0), ["repro", "evaluate@a"])
    return status, log, len(answers) - len(left)


def test_a_lost_record_is_made_again() -> None:
    assert _repro((1, LOST), (0, "done\n")) == (0, LOST + "done\n", 2)


def test_other_failures_are_not_repeated() -> None:
    assert _repro((1, DAMAGED), (0, "")) == (1, DAMAGED, 1)
    assert _repro((0, LOST), (1, "")) == (0, LOST, 1)


def test_it_ends() -> None:
    assert _repro(*[(1, LOST)] * (ATTEMPTS + 1)) == (1, LOST * ATTEMPTS, ATTEMPTS)
