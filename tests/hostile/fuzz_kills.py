"""Kills of DVC and all that it started, at seeded moments: of a stage that runs, or while DVC restores all of them.

Afterwards `facefolds doctor` and the same command recover, the results are those of an undisturbed run bit for bit,
nothing temporary is left, and nothing was touched outside the subject's folder and DVC's own files. What ends when DVC
alone is killed is tested in tests/pipeline/test_alone.py.
"""

from __future__ import annotations

import os
import shutil
import signal
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from facefolds_core.files.writing import PREFIX
from tests.hostile.damage import Counts, Outcome, differing, fingerprint
from tests.hostile.fuzz_disk import all_digests
from tests.pipeline.test_dvc_yaml import STAGES
from tests.pipeline.tiny import TinyProject

ROOT = Path(__file__).resolve().parents[2]
NAME = "kept"
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


class Project(TinyProject):
    """A tiny project that was run once, undisturbed.

    Attributes:
        commands: stage -> what runs it alone; "all" restores every stage out of DVC's cache.
        results, outside: digests of what the stages made, and of what must not change.
        seconds: how long each command takes.
    """

    def __init__(self, folder: Path, stages: Sequence[str]) -> None:
        super().__init__(ROOT, folder, PARAMS)
        for name in (f"data/{NAME}/.mygame-settings/a", "data/other/b"):
            (folder / name).parent.mkdir(parents=True)
            (folder / name).write_text("a user's file")
        targets = {stage: stage if stage == "configure" else f"{stage}@{NAME}" for stage in stages}
        self.targets = tuple(targets.values())
        self.commands = {k: ("dvc", "repro", "--force", "--single-item", target) for k, target in targets.items()}
        self.commands["all"] = ("dvc", "repro", self.targets[-1])
        self.seconds: dict[str, float] = {}
        self.done(*self.commands["all"])
        self.results = self.made()
        shutil.copy(folder / "dvc.lock", folder / "base.lock")
        self.outside = self.untouched()
        for name, command in self.commands.items():
            self.forget(name)
            start = time.perf_counter()
            self.done(*command)
            self.seconds[name] = time.perf_counter() - start
            self.reset()

    def forget(self, name: str) -> None:
        """What is to be restored is not known to be there."""
        if name == "all":
            (self.root / "dvc.lock").unlink()

    def reset(self) -> None:
        """What it was after the undisturbed run."""
        shutil.copy(self.root / "base.lock", self.root / "dvc.lock")
        self.done("dvc", "checkout", "--force", *self.targets)

    def made(self) -> dict[str, str]:
        return all_digests(self.root / "data" / NAME)

    def untouched(self) -> dict[str, str]:
        """What is neither a stage's output nor DVC's own."""
        own = (f"data/{NAME}", "data/.config", "data/.code", "data/.timings", "data/.locks", ".dvc", "dvc.lock")
        kept = f"data/{NAME}/.mygame-settings"
        found = fingerprint(self.root)
        return {k: v for k, v in found.items() if k.startswith(kept) or not k.startswith(own)}


def run(count: int, seed: int, folder: Path) -> Counts:
    """`count` kills, one after the other."""
    counts = Counts()
    folder.mkdir(parents=True, exist_ok=True)
    project = Project(folder / "project", STAGES[:3] if count <= SHORT else STAGES)
    for number in range(count):
        random = np.random.default_rng((seed, number))
        name = str(random.choice(list(project.commands)))
        after = float(random.uniform(0.2, 0.95)) * project.seconds[name]
        what = f"kills, seed {seed}, number {number}: {name} after {after:.2f} s"
        project.forget(name)
        process = project.start(*project.commands[name])
        time.sleep(after)
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        _recover(project, project.commands[name], what, counts)
        project.reset()
    return counts


def _recover(project: Project, command: tuple[str, ...], what: str, counts: Counts) -> None:
    for step in (("python", "-m", "facefolds_core", "doctor"), command):
        status, output = project.run(*step)
        if status != 0:
            counts.add(what, Outcome("crashed", f"{' '.join(step)}: {output[-600:]}"))
            return
    counts.add(what, Outcome("accepted"))
    if wrong := differing(project.made(), project.results):
        counts.kept_wrong.append(f"{what}: other results than undisturbed: {', '.join(wrong)}")
    harmed = differing(project.untouched(), project.outside)
    harmed += [str(path) for path in project.root.rglob(f"{PREFIX}*")]
    if harmed:
        counts.harmed.append(f"{what}: touched, or left: {', '.join(harmed)}")
