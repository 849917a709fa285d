"""A subject's training in parts, each a job: its base, its segments, and the subject itself, which puts them together.

Parts are no outputs of DVC's stages. They travel as `dvc add` keeps them: in DVC's cache or remote, each with a few
lines that say which (NAME.dvc), which the coordinator passes from job to job, and keeps for the next run.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from facefolds_core.cluster.job import Job, Outcome
from facefolds_core.files import write_json
from facefolds_core.reading import is_regular
from facefolds_core.training.segments.names import BASE, PLAN

KEPT = Path(".dvc", "tmp", "jobs", "parts")


class Parts:
    """What is done next, of subjects whose segments are jobs.

    Args:
        root: the project's folder.
        jobs: a job a subject: all of it.

    Attributes:
        first: the jobs to begin with.
    """

    def __init__(self, root: Path, jobs: Sequence[Job]) -> None:
        self.root, self.whole = root, {job.subject: replace(job, at_once=len(jobs)) for job in jobs}
        self.left: dict[str, set[str]] = {}
        self.failed: set[str] = set()
        self.wanted: dict[str, set[str]] = {}
        self.known = {name: self._read(name) for name in self.whole}
        self.first = [self._base(name) for name in self.whole]

    def after(self, outcome: Outcome) -> list[Job]:
        """The jobs that an outcome makes possible."""
        job = outcome.job
        if not job.part:
            return []
        if outcome.files:
            self.known[job.subject].update(outcome.files)
            self._write(job.subject)
        if job.part == BASE:
            return [] if outcome.error else self._segments(job.subject, outcome)
        self.left[job.subject].discard(job.name)
        if outcome.error:
            self.failed.add(job.subject)
        return self._put_together(job.subject)

    def _base(self, name: str) -> Job:
        bases = {file: text for file, text in self.known[name].items() if file.startswith(BASE)}
        return self._part(name, BASE, f"{name}.base", bases)

    def _part(self, name: str, part: str, job: str, files: Mapping[str, str]) -> Job:
        whole = self.whole[name]
        at_once = whole.at_once if part == BASE else 0
        target = f"subject@{name}"  # what a part is fitted to
        return replace(whole, name=job, target=target, part=part, files=tuple(sorted(files.items())), at_once=at_once)

    def _segments(self, name: str, outcome: Outcome) -> list[Job]:
        """Those that are not known, or, where there is none, the subject."""
        plan = outcome.plan or {"segments": []}
        # What the base's job recorded of the scene is there for the others.
        self.whole[name] = replace(self.whole[name], lock=outcome.lock or self.whole[name].lock)
        segments = plan["segments"]
        needed = {PLAN, plan["folder"]} if segments else set[str]()
        files = {file: text for file, text in self.known[name].items() if file in needed}
        self.wanted[name] = {segment["file"] for segment in segments} | needed - {PLAN}
        width = len(str(len(segments)))
        jobs = [
            self._part(name, str(one["number"]), f"{name}.segment-{one['number'] + 1:0{width}d}", files)
            for one in segments
            if one["file"] not in self.known[name]
        ]
        self.left[name] = {job.name for job in jobs}
        return jobs or self._put_together(name)

    def _put_together(self, name: str) -> list[Job]:
        if self.left[name] or name in self.failed:
            return []
        # What belongs to earlier frames or parameters is forgotten.
        self.known[name] = {file: text for file, text in self.known[name].items() if file in self.wanted[name]}
        self._write(name)
        return [replace(self.whole[name], files=tuple(sorted(self.known[name].items())))]

    def _read(self, name: str) -> dict[str, str]:
        path = self.root / KEPT / f"{name}.json"
        try:
            found: Any = json.loads(path.read_text(encoding="utf-8")) if is_regular(path) else {}
        except (OSError, ValueError):
            found = {}  # made again
        return {str(file): str(text) for file, text in found.items()} if isinstance(found, dict) else {}

    def _write(self, name: str) -> None:
        write_json(self.root / KEPT / f"{name}.json", dict(sorted(self.known[name].items())))
