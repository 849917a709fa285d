"""Which parts of a subject's training are jobs, and what follows what."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from facefolds_core.cluster.job import Job, Outcome
from facefolds_core.cluster.parts import Parts

WHOLE = Job("anna", "anna", "evaluate@anna", None, (("../capture", "/capture"),), "lock")


def plan(*files: str, base: str = "base-1") -> dict[str, Any]:
    return {"folder": base, "segments": [{"number": i, "file": file} for i, file in enumerate(files)]}


def base_done(parts: Parts, *files: str) -> list[Job]:
    left = {"plan.json": "plan", "base-1": "base"} if files else {"plan.json": "plan"}
    return parts.after(Outcome(parts.first[0], files=left, plan=plan(*files)))


def done(job: Job, file: str) -> Outcome:
    return Outcome(job, files={file: f"says {file}"})


def test_the_base_comes_first_then_segments_then_the_subject(tmp_path: Path) -> None:
    parts = Parts(tmp_path, [WHOLE])
    assert [(job.name, job.part, job.target, job.links) for job in parts.first] == [
        ("anna.base", "base", "subject@anna", WHOLE.links)
    ]
    segments = base_done(parts, "s0", "s1")
    assert [(job.name, job.part) for job in segments] == [("anna.segment-1", "0"), ("anna.segment-2", "1")]
    assert all(job.files == (("base-1", "base"), ("plan.json", "plan")) for job in segments)
    assert parts.after(done(segments[1], "s1")) == []
    last = parts.after(done(segments[0], "s0"))
    assert [(job.name, job.part, job.target) for job in last] == [("anna", "", "evaluate@anna")]
    assert last[0].files == (("base-1", "base"), ("s0", "says s0"), ("s1", "says s1"))
    assert parts.after(Outcome(last[0])) == []


def test_a_failed_segment_keeps_the_subject_back_and_not_the_others(tmp_path: Path) -> None:
    parts = Parts(tmp_path, [WHOLE])
    segments = base_done(parts, "s0", "s1")
    assert parts.after(Outcome(segments[0], error="diverged")) == []
    assert parts.after(done(segments[1], "s1")) == []
    again = Parts(tmp_path, [WHOLE])
    assert again.first[0].files == (("base-1", "base"),)
    assert [job.name for job in base_done(again, "s0", "s1")] == ["anna.segment-1"]


def test_what_is_known_is_not_made_again_and_what_has_gone_is_forgotten(tmp_path: Path) -> None:
    parts = Parts(tmp_path, [WHOLE])
    for job, file in zip(base_done(parts, "s0", "s1"), ("s0", "s1"), strict=True):
        parts.after(done(job, file))
    jobs = base_done(Parts(tmp_path, [WHOLE]), "s1")
    assert [(job.name, dict(job.files).keys()) for job in jobs] == [("anna", {"base-1", "s1"})]
    assert [job.part for job in base_done(Parts(tmp_path, [WHOLE]), "s0", "s1")] == ["0"]


def test_a_take_without_segments_is_done_at_once(tmp_path: Path) -> None:
    assert [job.name for job in base_done(Parts(tmp_path, [WHOLE]))] == ["anna"]


@pytest.mark.parametrize("text", ["{", "[]", ""])
def test_a_damaged_note_is_made_again(tmp_path: Path, text: str) -> None:
    (tmp_path / ".dvc" / "tmp" / "jobs" / "parts").mkdir(parents=True)
    (tmp_path / ".dvc" / "tmp" / "jobs" / "parts" / "anna.json").write_text(text)
    assert Parts(tmp_path, [WHOLE]).first[0].files == ()
