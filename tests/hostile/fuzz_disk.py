"""Every stage on a disk that is full, and under a limit of file sizes (`ulimit -f`), at seeded points.

A stage either ends with a message that names a file, and its outputs are still those of the run before; or it has room
enough, and makes the same as ever. Full disks are small ones in memory: they need root on Linux.
"""

from __future__ import annotations

import io
import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, chdir, contextmanager, redirect_stderr, redirect_stdout
from importlib import import_module
from pathlib import Path

import numpy as np

from facefolds_core.errors import as_user_error
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.files.reading import STAGE_OUTPUTS
from facefolds_core.files.writing import PREFIX, write_json
from stages.configure import configure
from tests.golden import digests
from tests.hostile.damage import Counts, Outcome, differing, fingerprint, outcome

Stage = Callable[[SubjectFolders], str]
STAGES: dict[str, tuple[Stage, tuple[str, ...]]] = {
    "configure": (lambda folders: configure(folders.root.parent), ("../.config", "../.code")),
    **{
        name: (
            getattr(import_module(f"facefolds_core.pipeline.{name}"), name),
            outputs[:1] if name == "train" else outputs,
        )
        for name, outputs in STAGE_OUTPUTS.items()
    },
}
"""Name -> what it does, its outputs; of `train` without its log, whose small files say little of a full disk."""
PARAMS = """\
subjects:
  tight:
    source: actor
    path: facefolds_core/captures/actor
    holdout: {every: 4}
capture: {cameras: 6, frames: 2, height: 48, width: 32, plates: false, mattes: true}
normalize: {}
subject: {iterations: 10, fewest: 200}
train: {preset: quick, iterations: 8, checkpoint_seconds: 0.001, rays: 128, layers: 3, texture_width: 16,
        manifold_width: 16}
sample: {resolution: 32}
reconstruct: {}
decimate: {resolution: 8}
texture: {resolution: 16}
bake: {hold: 0.02}
compress: {photos: 1, levels: [], video: {codec: [h264], target_psnr: null, preset: fast}}
evaluate: {films: false, sheet_frames: 1}
"""
DISK = 32 * 2**20
"""Bytes of the small disk."""


class NoSmallDiskError(Exception):
    """This machine lets us mount none."""


@contextmanager
def small_disk(folder: Path) -> Iterator[Path]:
    """A disk of its own for the block.

    Raises:
        NoSmallDiskError: without root, or in a container that forbids it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    command = ["mount", "-t", "tmpfs", "-o", f"size={DISK}", "tmpfs", str(folder)]
    if not sys.platform.startswith("linux") or subprocess.run(command, capture_output=True).returncode:
        raise NoSmallDiskError("no small disk can be mounted here: it needs root on Linux")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


@contextmanager
def limited_files(size: int) -> Iterator[None]:
    """No file of this process may grow beyond `size` bytes in the block."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@contextmanager
def filled_disk(folder: Path, free: int) -> Iterator[None]:
    """The disk of `folder` has only about `free` bytes left in the block."""
    filler = folder / "filler"
    with filler.open("wb") as file:
        os.posix_fallocate(file.fileno(), 0, max(1, os.statvfs(folder).f_bavail * os.statvfs(folder).f_bsize - free))
    try:
        yield
    finally:
        filler.unlink()


def run(count: int, seed: int, folder: Path) -> Counts:
    """`count` cases: the stages in turn, every second one, and then the others, on a full disk where one can be had."""
    counts = Counts()
    with ExitStack() as stack:
        try:
            root, disk = stack.enter_context(small_disk(folder / "disk")), True
        except NoSmallDiskError as error:
            root, disk = folder, False
            sys.stderr.write(f"disk: {error}; limits of file sizes only\n")
        stack.enter_context(chdir(root))
        (root / "params.yaml").write_text(PARAMS)
        folders = SubjectFolders(root / "data" / "tight")
        for name, (work, _) in STAGES.items():
            _quietly(work, folders)
            write_json(folders.timing(name), {"stage": name, "seconds": 1.0})
        good = all_digests(folders.root)
        for number in range(count):
            random = np.random.default_rng((seed, number))
            name = list(STAGES)[number % len(STAGES)]
            full = disk and (number + number // len(STAGES)) % 2 == 1
            _case(folders, name, full, random, good, f"disk, seed {seed}, number {number}", counts)
    return counts


def all_digests(root: Path) -> dict[str, str]:
    """What all stages made: the subject's files, and those that `configure` writes beside them."""
    beside = {f"{n}/{k}": v for n in (".config", ".code") for k, v in fingerprint(root.parent / n).items()}
    return {**digests(root), **beside}


def _quietly(work: Stage, folders: SubjectFolders) -> None:
    """Do a stage's work; what a user can mend is raised as `UserError`, which must name a file.

    Its messages go nowhere: they must not fail for want of space themselves.
    """
    try:
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            work(folders)
    except Exception as error:
        users = as_user_error(error)
        if users is None:
            raise
        if users.file is None:
            raise AssertionError(f"no file is named: {users}") from error
        raise users from None


def _case(
    folders: SubjectFolders,
    name: str,
    full: bool,
    random: np.random.Generator,
    good: dict[str, str],
    what: str,
    counts: Counts,
) -> None:
    work, outputs = STAGES[name]
    files = [p for o in outputs for p in sorted([folders.root / o, *(folders.root / o).rglob("*")]) if p.is_file()]
    sizes = [path.stat().st_size for path in files]
    size = int(random.integers(0, 1 + (2 * sum(sizes) if full else max(1, int(random.choice(sizes))))))
    what += f", {name}, {f'{size} bytes free' if full else f'no file above {size} bytes'}"
    before = fingerprint(folders.root.parent)
    with filled_disk(folders.root.parents[1], size) if full else limited_files(size):
        result = outcome(lambda: _quietly(work, folders))
    counts.add(what, result)
    if result.kind == "accepted":
        wrong = differing(all_digests(folders.root), good)
        counts.kept_wrong += [f"{what}: other results: {', '.join(wrong)}"] if wrong else []
    else:
        changed = differing(before, fingerprint(folders.root.parent))
        harmed = [n for n in changed if not n.startswith(("tight/training", "tight/checkpoints"))]
        counts.harmed += [f"{what}: {result.text}: changed {', '.join(harmed)}"] if harmed else []
    left = [str(path) for path in folders.root.parent.rglob(f"{PREFIX}*")]
    counts.harmed += [f"{what}: left {', '.join(left)}"] if left else []
    if result.kind != "accepted":  # there is room again: the same command makes the same
        counts.kept_wrong += _again(work, folders, good, what)


def _again(work: Stage, folders: SubjectFolders, good: dict[str, str], what: str) -> list[str]:
    result = outcome(lambda: _quietly(work, folders))
    wrong = differing(all_digests(folders.root), good)
    if result != Outcome("accepted") or wrong:
        return [f"{what}: again, with room: {result.text} {', '.join(wrong)}"]
    return []
