"""`facefolds run --segments` against the real DVC, the real Dask and the real training."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import psutil
import pytest

from facefolds_core.processes import THREADS as VARIABLES
from tests.cluster.takes import make_take
from tests.cluster.test_run import dask_cluster, environment, files_of

THREADS = dict.fromkeys(VARIABLES, "1")
PATIENCE = 600.0
"""Seconds for each half."""

CHECKPOINT = ".dvc/cache/begun/*/take/*/state.json"
"""Of a base, in a project's folder."""

pytestmark = [pytest.mark.pipeline, pytest.mark.nightly]


def result(root: Path) -> dict[str, bytes]:
    """Model and log, without the times in training.json."""
    found = {f"model/{name}": content for name, content in files_of(root / "data" / "take" / "model").items()}
    found |= {f"training/{name}": content for name, content in files_of(root / "data" / "take" / "training").items()}
    report = json.loads(found.pop("model/training.json"))
    found["model/training.json"] = json.dumps([report["iterations"], report["final_psnr"]]).encode()
    assert "model/segments/00002.safetensors" in found
    return found


def training(worker: subprocess.Popen[bytes], part: str) -> bool:
    """Whether a base, or a segment, is under way there, and past the imports."""
    for process in psutil.Process(worker.pid).children(recursive=True):
        with suppress(psutil.Error):  # it has ended
            words = process.cmdline()
            made = words[words.index("--part") + 1] if "--part" in words else ""
            if made and (made == "base") == (part == "base") and sum(process.cpu_times()[:2]) > 3:
                return True
    return False


def begin(root: Path, project_root: Path, *command: str) -> subprocess.Popen[str]:
    """A command on one thread: on a machine with other work a thread that waits for others waits long."""
    return subprocess.Popen(
        [sys.executable, "-m", *command],
        cwd=root,
        env=environment(project_root, **THREADS),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


@pytest.mark.timeout(2 * PATIENCE)
@pytest.mark.parametrize(("part", "begun"), [("base", 2), ("segment", 4)])
def test_a_take_is_what_dvc_repro_makes_though_a_worker_was_killed_in_mid_part(
    part: str, begun: int, tmp_path: Path, project_root: Path
) -> None:
    serial, root = (make_take(tmp_path / name, project_root) for name in ("serial", "cluster"))
    with dask_cluster(tmp_path, project_root, **THREADS) as (address, workers):
        repro = begin(serial, project_root, "dvc", "repro", "train@take")
        command = ["facefolds_core", "run", "--segments", "take", "--to", "train", "--scheduler", address]
        process = begin(root, project_root, *command)
        deadline = time.monotonic() + PATIENCE
        busy: list[subprocess.Popen[bytes]] = []
        while process.poll() is None and time.monotonic() < deadline and not busy:
            if part == "segment" or list(root.glob(CHECKPOINT)):
                busy = [worker for worker in workers if training(worker, part)]
            time.sleep(0.05)
        assert busy
        busy[0].kill()
        output, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, output
    said = [line for line in output.splitlines() if f".{part}" in line and ": train on " in line]
    assert len(said) == begun, "the base, or one of the three segments, was begun twice"
    assert repro.wait(PATIENCE) == 0
    assert result(root) == result(serial)
    assert not list(root.glob(CHECKPOINT)), "who went on with the base deleted its checkpoint"
