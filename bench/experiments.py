"""The runs of `dvc exp show --json`: parameters that differ and what `evaluate` measured, experiment by experiment."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from facefolds_core.cluster.table import Run, figures_of
from facefolds_core.errors import UserError
from facefolds_core.params import STAGE_SECTIONS

PARAMS = "params.yaml"
METRICS = "data/{subject}/metrics.json"
PENDING = ("queued", "running")


@dataclass(frozen=True)
class _Shown:
    """One revision as DVC shows it."""

    name: str
    revision: str
    data: Mapping[str, Any]
    error: str
    pending: bool


def shown_experiments() -> object:
    """What `dvc exp show --json` says in this folder.

    Raises:
        UserError: with DVC's own message, if it fails.
    """
    command = [sys.executable, "-m", "dvc", "exp", "show", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        remedy = "run this in the project's root folder, a git checkout"
        raise UserError("`dvc exp show` failed", found=done.stderr.strip()[-500:], remedy=remedy)
    return json.loads(done.stdout)


def runs_of(shown: Any) -> tuple[list[Run], int]:
    """Rows, and how many experiments have not ended yet.

    A row is an experiment (or the working folder, "workspace", or a commit) and a subject. Its parameters are those of
    the stages' sections, the subject's overrides merged in, that differ among the subject's rows.

    Args:
        shown: the parsed JSON.

    Raises:
        UserError: if it is not of the kind that DVC 3 writes.
    """
    try:
        revisions = list(_revisions(shown))
        pending = sum(revision.pending for revision in revisions)
        runs = [run for revision in revisions if not revision.pending for run in _runs(revision)]
    except (KeyError, TypeError, AttributeError) as error:
        raise UserError(
            "not what `dvc exp show --json` writes", found=repr(error), remedy="use DVC 3, which the project installs"
        ) from None
    measured = {run.subject for run in runs if run.figures}
    known = [run for run in runs if run.figures or (run.error and (run.subject in measured or not measured))]
    subjects = sorted({run.subject for run in known})
    return [row for subject in subjects for row in _rows([run for run in known if run.subject == subject])], pending


def _revisions(shown: Any) -> Iterator[_Shown]:
    for commit in shown:
        name = commit.get("name") or commit["rev"]
        yield _shown(commit, name, "")
        for experiment in commit.get("experiments") or ():
            state = (experiment.get("executor") or {}).get("state") or ""
            yield _shown(experiment["revs"][0], experiment.get("name") or "", state)


def _shown(entry: Mapping[str, Any], name: str, state: str) -> _Shown:
    revision = entry["rev"]
    error = (entry.get("error") or {}).get("msg") or ("failed" if state.lower() == "failed" else "")
    name = entry.get("name") or name or revision[:7]
    return _Shown(name, revision[:12], entry.get("data") or {}, error, state.lower() in PENDING)


def _runs(shown: _Shown) -> Iterator[Run]:
    file = (shown.data.get("params") or {}).get(PARAMS) or {}
    params = file.get("data") or {}
    metrics = shown.data.get("metrics") or {}
    for subject in params.get("subjects") or ():
        found = (metrics.get(METRICS.format(subject=subject)) or {}).get("data") or {}
        figures = figures_of(found)
        error = shown.error if not shown.error or not figures else ""
        yield Run(shown.name, subject, shown.revision, sections_of(params, subject), figures, error)


def sections_of(params: Mapping[str, Any], subject: str) -> dict[str, Any]:
    """ "section.key" -> value for one subject, from a whole params.yaml; overrides beat sections."""
    found: dict[str, Any] = {}
    for values in (params, params["subjects"][subject]):
        for stage in STAGE_SECTIONS:
            found |= dict(_leaves(stage, values.get(stage) or {}))
    return found


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and value:
        for key, inner in value.items():
            yield from _leaves(f"{name}.{key}", inner)
    elif value != {}:
        yield name, value


def _rows(runs: list[Run]) -> list[Run]:
    """Of one subject: with the parameters that differ."""
    names = list(dict.fromkeys(name for run in runs for name in run.params))
    differ = [name for name in names if len({json.dumps(run.params.get(name)) for run in runs}) > 1]
    return [replace(run, params={name: run.params[name] for name in differ if name in run.params}) for run in runs]
