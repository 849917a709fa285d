"""What was measured: one JSON file that grows by one entry a measurement and is never left half written."""

from __future__ import annotations

import os
import platform
import subprocess
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from facefolds_core.errors import UserError
from facefolds_core.files import read_json, write_json

VERSION = 1
ClockKind = Literal["wall", "processor"]
Positive = Annotated[float, Field(gt=0)]
Entry = TypeVar("Entry", bound=BaseModel)


class Conditions(BaseModel):
    """Where and how a measurement was made.

    Attributes:
        commit: first 12 digits, and "+" if tracked files had been changed since.
        clock: "wall", or "processor": processor time of the process divided by `threads`.
        threads: of the clock. Under "wall" the number that worked; under "processor" the number that is assumed to
            share the work evenly, which flatters code that does not.
        machine: processors, and what torch ran on.
        frames: frames of each held-out camera that were scored, evenly spaced.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    commit: str
    clock: ClockKind
    threads: Annotated[int, Field(ge=1)]
    machine: str
    frames: Annotated[int, Field(ge=1)]


class Scores(BaseModel):
    """Means over the scored images, of the model without its view branch (docs/metrics.md, `diffuse`).

    Attributes:
        region: "subject", or "frame" where the capture has no masks.
        images: how many.
        lpips, st_lpips: None where their weights are not on the machine.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    region: Literal["subject", "frame"]
    images: int
    psnr: float
    ssim: float
    lpips: float | None
    st_lpips: float | None


class Measurement(BaseModel):
    """One training, or one moment of it.

    Attributes:
        variant: what differs from the preset; "" for nothing.
        budget: seconds asked for.
        seconds: of training, start included, evaluation not.
        peak_memory_bytes: of the process, before anything was evaluated.
        scores: None if training failed.
        failure: the first line of the error, or "".
        date: UTC, ISO 8601.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    subject: str
    preset: str
    variant: str = ""
    budget: Positive
    seconds: float
    iterations: int
    peak_memory_bytes: int
    scores: Scores | None
    failure: str = ""
    date: str
    conditions: Conditions

    def same_as(self, other: Measurement) -> bool:
        """Whether one of the two makes the other superfluous."""
        return (*self.key(), self.budget) == (*other.key(), other.budget)

    def key(self) -> tuple[str, ...]:
        """All that must agree for two measurements to be one series; the machine may differ."""
        c = self.conditions
        return self.subject, self.preset, self.variant, c.commit, c.clock, str(c.threads), str(c.frames)


def read_entries(path: Path, name: str, version: int, kind: type[Entry]) -> list[Entry]:
    """The list `name` in a file of `{"version": ..., name: [...]}`; empty if there is no file.

    Raises:
        UserError: if the file is not one of these.
    """
    if not path.exists():
        return []
    remedy = "restore it (`git checkout`), or delete it to measure again"
    value = read_json(path, remedy=remedy)
    try:
        if value["version"] != version:
            raise UserError(
                "results of another version",
                file=path,
                expected=f"version {version}",
                found=value["version"],
                remedy=remedy,
            )
        return [kind.model_validate(entry) for entry in value[name]]
    except (KeyError, TypeError, ValidationError) as error:
        raise UserError("garbled results", file=path, found=str(error)[:300], remedy=remedy) from None


class Results:
    """The measurements of one file.

    Args:
        path: of the JSON file, which need not exist.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def read(self) -> list[Measurement]:
        """All measurements, in the order in which they were made.

        Raises:
            UserError: if the file is not one of these.
        """
        return read_entries(self.path, "measurements", VERSION, Measurement)

    def add(self, measurement: Measurement) -> None:
        """Keep it, in place of the same one measured before. The file is read again: others may have added to it."""
        kept = [m for m in self.read() if not m.same_as(measurement)]
        entries = [m.model_dump(mode="json") for m in [*kept, measurement]]
        write_json(self.path, {"version": VERSION, "measurements": entries})

    def measured(self, wanted: Measurement) -> bool:
        return any(m.same_as(wanted) for m in self.read())


def describe(measurement: Measurement) -> str:
    """One line for the terminal."""
    m, s = measurement, measurement.scores
    what = ", ".join(part for part in (m.subject, m.preset, m.variant) if part)
    cost = f"{m.seconds:.1f} s ({m.iterations} iterations, {m.peak_memory_bytes / 2**30:.2f} GiB)"
    if s is None:
        return f"{what}: failed after {cost}: {m.failure}"
    distance = "" if s.st_lpips is None else f", ST-LPIPS {s.st_lpips:.3f}"
    return f"{what}: {s.psnr:.2f} dB, SSIM {s.ssim:.3f}{distance} on the {s.region} after {cost}"


def commit_name(folder: Path) -> str:
    """First 12 digits of the commit, "+" if tracked files differ from it; "unknown" outside a git checkout."""

    def git(*arguments: str) -> str | None:
        try:
            done = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, text=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            return None
        return done.stdout.strip()

    commit = git("rev-parse", "--short=12", "HEAD")
    if commit is None:
        return "unknown"
    # Results themselves are tracked: they must not make their own commit look changed.
    own = [f":(top,exclude){path}" for path in ("bench/results", "docs/images")]
    return commit + ("+" if git("status", "--porcelain", "-uno", "--", ":/", *own) else "")


def machine_name(device: str) -> str:
    """Processors and device, e.g. "2 x Intel(R) Xeon(R), cpu (2 threads)"."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = [
            line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")
        ]
        model = lines[0] if lines else model
    return f"{os.cpu_count()} x {model}, {device}"
