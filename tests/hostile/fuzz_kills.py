"""Kills at seeded moments: of DVC alone, of a stage alone, of both, and while DVC rewrites dvc.lock.

Afterwards nothing runs on, `facefolds doctor` and `dvc repro` recover, the results are those of an undisturbed
run bit for bit, nothing temporary is left, and nothing was touched outside the subject's folder and DVC's own files.
"""

from __future__ import annotations

import os
import shutil
import signal
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil

from facefolds_core.files.writing import PREFIX
from tests.golden import digests
from tests.hostile.damage import Counts, Outcome, fingerprint
from tests.pipeline.tiny import TinyProject

ROOT = Path(__file__).resolve().parents[2]
NAME = "kept"
STAGES = (
    *("configure", "capture", "normalize", "subject", "train", "sample", "reconstruct"),
    *("decimate", "texture", "bake", "compress", "evaluate"),
)
SHORT = 5
"""Up to so many kills, the first three stages only: the tests' run."""

PARAMS = """\
subjects:
  kept:
    source: actor
    path: facefolds_core/captures/actor
    holdout: {every: 4}
capture: {cameras: 8, frames: 2, height: 48, width: 32}
normalize: {}
subject: {iterations: 200}
train: {preset: quick, iterations: 300, checkpoint_seconds: 0.2, rays: 256, layers: 3, texture_width: 32,
        manifold_width: 32}
sample: {resolution: 64}
reconstruct: {method: poisson}
decimate: {resolution: 12}
texture: {resolution: 32}
bake: {}
compress: {levels: [], video: {target_psnr: null, preset: slow}}
evaluate: {}
"""

ENDS_WITHIN = 20.0
"""Seconds after a kill within which everything that DVC started must have ended."""

VICTIMS = ("dvc", "stage", "group")


def target(stage: str) -> str:
    """What DVC calls the stage."""
    return stage if stage == "configure" else f"{stage}@{NAME}"


@dataclass
class Project:
    """A tiny project that was run once, undisturbed.

    Attributes:
        tiny: it.
        stages: those in use.
        results: digests of what they made.
        seconds: how long each stage takes, with DVC; and "restore", all of them out of DVC's cache.
        outside: what must not change.
    """

    tiny: TinyProject
    stages: tuple[str, ...]
    results: dict[str, str] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    outside: dict[str, str] = field(default_factory=dict)

    @property
    def data(self) -> Path:
        return self.tiny.root / "data" / NAME

    @property
    def lock(self) -> Path:
        return self.tiny.root / "dvc.lock"

    @property
    def all(self) -> tuple[str, ...]:
        return ("dvc", "repro", target(self.stages[-1]))

    def one(self, stage: str) -> tuple[str, ...]:
        return ("dvc", "repro", "--force", "--single-item", target(stage))

    def made(self) -> dict[str, str]:
        """Digests of what all stages made."""
        data = self.data.parent
        beside = {f"{n}/{k}": v for n in (".config", ".code") for k, v in fingerprint(data / n).items()}
        return {**digests(self.data), **beside}

    def untouched(self) -> dict[str, str]:
        """What is neither a stage's output nor DVC's own."""
        found = fingerprint(self.tiny.root)
        own = (f"data/{NAME}", "data/.config", "data/.code", "data/.timings", "data/.locks", ".dvc", "dvc.lock")
        kept = f"data/{NAME}/.mygame-settings"
        return {k: v for k, v in found.items() if k.startswith(kept) or not k.startswith(own)}

    def reset(self) -> None:
        """What it was after the undisturbed run."""
        shutil.copy(self.tiny.root / "base.lock", self.lock)
        status, output = self.tiny.run("dvc", "checkout", "--force", *map(target, self.stages))
        assert status == 0, output


def prepare(folder: Path, stages: tuple[str, ...]) -> Project:
    """Run the pipeline undisturbed; note what it makes and how long it takes."""
    tiny = TinyProject(ROOT, folder, PARAMS)
    for name in (f"data/{NAME}/.mygame-settings/a", "data/other/b"):
        (folder / name).parent.mkdir(parents=True)
        (folder / name).write_text("a user's file")
    project = Project(tiny, stages)
    for stage in stages:
        status, output = tiny.run("dvc", "repro", "--single-item", target(stage))
        assert status == 0, output
    project.results = project.made()
    shutil.copy(project.lock, folder / "base.lock")
    for stage in stages[-1:] if len(stages) < len(STAGES) else stages:
        project.seconds[stage] = _timed(tiny, *project.one(stage))
    project.reset()
    project.lock.unlink()
    project.seconds["restore"] = _timed(tiny, *project.all)
    project.reset()
    project.outside = project.untouched()
    return project


def _timed(tiny: TinyProject, *command: str) -> float:
    start = time.perf_counter()
    status, output = tiny.run(*command)
    assert status == 0, output
    return time.perf_counter() - start


def run(count: int, seed: int, folder: Path) -> Counts:
    """`count` kills, one after the other."""
    counts = Counts()
    folder.mkdir(parents=True, exist_ok=True)
    project = prepare(folder / "project", STAGES[:3] if count <= SHORT else STAGES)
    for number in range(count):
        random = np.random.default_rng((seed, number))
        way = ("stage", "restore", "stage", "lock")[number % 4] if count > SHORT else ("stage", "lock")[number % 2]
        _case(project, way, random, f"kills, seed {seed}, number {number}: {way}", counts)
    return counts


def _case(project: Project, way: str, random: np.random.Generator, what: str, counts: Counts) -> None:
    stage = str(random.choice([name for name in project.stages if name in project.seconds]))
    victim = VICTIMS[int(random.integers(3))] if way == "stage" else VICTIMS[2 * int(random.integers(2))]
    number = signal.SIGTERM if random.integers(2) else signal.SIGKILL
    command = project.one(stage) if way == "stage" else project.all
    after = float(random.uniform(0.2, 0.95)) * project.seconds[stage if way == "stage" else "restore"]
    what += f", {victim} with {number.name} after {after:.2f} s of {' '.join(command[1:])}"
    if way != "stage":
        project.lock.unlink()
    process = project.tiny.start(*command)
    if way == "lock":
        _wait_until_empty(project.lock, process.pid)
        os.kill(process.pid, signal.SIGKILL)
    else:
        time.sleep(after)
        _kill(process.pid, victim, number)
    left = _still_running(process.pid)
    if left:
        counts.hung.append(f"{what}: still running after {ENDS_WITHIN:.0f} s: {left}")
        os.killpg(process.pid, signal.SIGKILL)
    output = process.communicate()[0]
    if "Traceback" in output:
        counts.crashed.append(f"{what}: {output[-600:]}")
    _recover(project, command, what, counts)
    project.reset()


def _recover(project: Project, command: tuple[str, ...], what: str, counts: Counts) -> None:
    for step in (("python", "-m", "facefolds_core", "doctor"), command):
        status, output = project.tiny.run(*step)
        if status != 0:
            counts.add(what, Outcome("crashed", f"{' '.join(step)}: {output[-600:]}"))
            return
    counts.add(what, Outcome("accepted"))
    found = project.made()
    wrong = sorted(name for name in {*found, *project.results} if found.get(name) != project.results.get(name))
    if wrong:
        counts.kept_wrong.append(f"{what}: other results than undisturbed: {', '.join(wrong)}")
    outside = project.untouched()
    harmed = sorted(n for n in {*outside, *project.outside} if outside.get(n) != project.outside.get(n))
    harmed += [str(path) for path in project.tiny.root.rglob(f"{PREFIX}*")]
    if harmed:
        counts.harmed.append(f"{what}: touched, or left: {', '.join(harmed)}")


def _wait_until_empty(lock: Path, pid: int) -> None:
    """Until DVC is just rewriting dvc.lock; not for ever."""
    deadline = time.monotonic() + 60
    seen = 0
    while psutil.pid_exists(pid) and time.monotonic() < deadline and seen < 2:
        try:
            # Once when it is made, and again when it is rewritten.
            if lock.stat().st_size == 0:
                seen += 1
                while seen < 2 and lock.stat().st_size == 0:
                    pass
        except FileNotFoundError:
            pass
        if psutil.Process(pid).status() == psutil.STATUS_ZOMBIE:
            return


def _kill(pid: int, victim: str, number: signal.Signals) -> None:
    """One of the three; what has ended already is no victim any more."""
    if victim == "group":
        os.killpg(pid, number)
        return
    victims = [pid]
    if victim == "stage":
        try:
            below = psutil.Process(pid).children(recursive=True)
            victims = [child.pid for child in below if "stages." in " ".join(child.cmdline())]
        except psutil.Error:
            victims = []
    with suppress(ProcessLookupError):
        for one in victims[-1:]:
            os.kill(one, number)


def _still_running(session: int) -> list[str]:
    """Commands of DVC's session that have not ended within ENDS_WITHIN; waits for DVC itself if it was not killed."""
    deadline = time.monotonic() + ENDS_WITHIN
    while True:
        left = [p for p in psutil.process_iter(["status"]) if _session(p) == session]
        left = [p for p in left if p.info["status"] != psutil.STATUS_ZOMBIE]
        if not left or time.monotonic() > deadline:
            return [" ".join(p.cmdline())[:100] for p in left]
        time.sleep(0.1)


def _session(process: psutil.Process) -> int:
    try:
        return os.getsid(process.pid)
    except ProcessLookupError:
        return -1
