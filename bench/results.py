"""What was measured: JSON files that grow by an entry a measurement and are never left half written."""

from __future__ import annotations

import os
import platform
import subprocess
from collections.abc import Callable, Iterable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, ClassVar, Generic, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from facefolds_core.errors import UserError
from facefolds_core.files.writing import read_json, write_json

ROOT = Path(__file__).resolve().parents[1]
Clock = Literal["wall", "processor"]
Means = dict[str, float | None]


class Record(BaseModel):
    """Base of all that is kept: unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Entry(Record):
    """One measurement; those of equal `key` replace each other. `failure`: an error's first line, or ""."""

    KEY: ClassVar[tuple[str, ...]] = ()
    failure: str = ""
    date: str = ""

    @property
    def key(self) -> tuple[object, ...]:
        return tuple(getattr(self, name) for name in self.KEY)


class Conditions(Record):
    """Where and how a training was measured. `clock` "processor": processor time divided by `threads`, which flatters
    code that does not share it. `frames`: of each held-out camera that were scored, evenly spaced."""

    commit: str
    clock: Clock
    threads: Annotated[int, Field(ge=1)]
    machine: str
    frames: Annotated[int, Field(ge=1)]


class Scores(Record):
    """Means over `images` images of the model without its view branch (docs/reference/metrics.md, `diffuse`), of the
    subject, or of the whole frame where the capture has no masks."""

    region: Literal["subject", "frame"]
    images: int
    psnr: float
    ssim: float
    lpips: float | None
    st_lpips: float | None


class Measurement(Entry):
    """A training: its seconds, start included, scoring not. `budget`: seconds that were asked for, if any were."""

    subject: str
    preset: str
    budget: float = 0.0
    seconds: float = 0.0
    iterations: int
    peak_memory_bytes: int = 0
    scores: Scores | None = None
    conditions: Conditions

    @property
    def key(self) -> tuple[object, ...]:
        c, asked = self.conditions, self.budget or self.iterations
        return self.subject, self.preset, bool(self.budget), asked, c.commit, c.clock, c.threads, c.frames


class Cell(Entry):
    """A training under a hazard (bench/hazards.py); what was not kept is 0 or empty.

    Attributes:
        subject: "film", small and with a cut budget, or a subject with all of its preset's.
        psnr: of the subject, dB: mean of the held-out cameras (of the film: those inside its rig) and frames.
        views: held-out camera -> dB.
        flat: PSNR of a silhouette of the subject's true shape in one colour, dB: a model below it shows nothing.
        seconds: processor time of training.
    """

    KEY = ("subject", "hazard", "strength", "preset", "seed")
    subject: str = "film"
    hazard: str
    strength: float
    preset: str
    seed: int
    psnr: float | None = None
    views: dict[str, float] = {}
    scores: Means = {}
    flat: float = 0.0
    iterations: int = 0
    seconds: float = 0.0
    peak_memory_bytes: int = 0
    commit: str = ""

    @property
    def converged(self) -> bool:
        """It ended without an error, and shows more than a flat silhouette would."""
        return not self.failure and self.psnr is not None and self.psnr > self.flat


class Row(Entry):
    """An asset with a few values of its subject's configuration changed (bench/sweeps.py).

    Attributes:
        params: "section.key" -> value of what differs, numbers only.
        figures: by `figures_of`; pictures a second that `renderer` draws; empty if it failed.
    """

    KEY = ("sweep", "subject", "value")
    sweep: str
    subject: str
    value: Annotated[int, Field(ge=1)]
    params: dict[str, int | float]
    commit: str
    machine: str
    figures: dict[str, float] = {}
    renderer: str = ""

    @property
    def bytes(self) -> int:
        """Of meshes and texture video."""
        return int(self.figures["mesh_bytes"] + self.figures["texture_bytes"])

    @property
    def psnr(self) -> float:
        """Of the subject, where the capture has masks; else of the whole frame. Nothing of a failed one."""
        return self.figures.get("psnr_subject", self.figures.get("psnr", float("nan")))


Kind = TypeVar("Kind", bound=Entry)


class Store(Generic[Kind]):
    """A file of `{"version": 1, name: [...]}`, which need not exist."""

    def __init__(self, path: Path, name: str, kind: type[Kind]) -> None:
        self.path, self._name, self._kind = path, name, kind

    def read(self) -> list[Kind]:
        """All entries, in the order in which they were made.

        Raises:
            UserError: if the file is not one of these.
        """
        remedy = "restore it (`git checkout`), or delete it to measure again"
        if not self.path.exists():
            return []
        value = read_json(self.path, remedy=remedy)
        try:
            if value["version"] != 1:
                raise ValueError(f"version {value['version']}, not 1")
            return [self._kind.model_validate(entry) for entry in value[self._name]]
        except (KeyError, TypeError, ValueError) as error:
            raise UserError("garbled results", file=self.path, found=str(error)[:300], remedy=remedy) from None

    def fill(self, blanks: Iterable[Kind], measure: Callable[[Kind], Kind], force: bool = False) -> Iterator[Kind]:
        """Measure what is not there (or all), and keep each as soon as it is measured."""
        done = set() if force else {entry.key for entry in self.read()}
        for blank in blanks:
            if blank.key not in done:
                found = measure(blank)
                self.add(found)
                yield found

    def add(self, entry: Kind) -> None:
        """Keep it in place of the same one measured before. The file is read again: others may have added to it."""
        kept = [other for other in self.read() if other.key != entry.key]
        write_json(self.path, {"version": 1, self._name: [one.model_dump(mode="json") for one in [*kept, entry]]})


def now() -> str:
    """UTC, ISO 8601."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def mean(values: list[float | None]) -> float | None:
    """Of those that are there, 5 decimals."""
    known = [value for value in values if value is not None]
    return round(float(np.mean(known)), 5) if known else None


def commit_name(folder: Path = ROOT) -> str:
    """First 12 digits of the commit, "+" if tracked files differ from it; "unknown" outside a git checkout."""
    # Results themselves are tracked: they must not make their own commit look changed.
    own = [f":(top,exclude){path}" for path in ("bench/results", "docs/images")]
    commands = ["rev-parse", "--short=12", "HEAD"], ["status", "--porcelain", "-uno", "--", ":/", *own]
    said = [subprocess.run(["git", "-C", folder, *c], capture_output=True, text=True, check=False) for c in commands]
    commit, changed = (done.stdout.strip() for done in said)
    return commit + ("+" if changed else "") or "unknown"


def machine_name(device: str) -> str:
    """Processors and device, e.g. "2 x Intel(R) Xeon(R), cpu (2 threads)"."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{os.cpu_count()} x {[*models, platform.processor() or platform.machine()][0]}, {device}"
