"""`facefolds run` against the real DVC and the real Dask."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import psutil
import pytest
import yaml

from facefolds_core.system.processes import own_environment
from tests.cluster.small import make_project

pytestmark = pytest.mark.pipeline


def run(root: Path, project_root: Path, *arguments: str, **more: str) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-m", *arguments],
        cwd=root,
        env=own_environment(PYTHONPATH=str(project_root), **more),
        capture_output=True,
        text=True,
        timeout=200,
    )
    return done.returncode, done.stdout + done.stderr


def files_of(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@contextmanager
def dask_cluster(
    tmp_path: Path, project_root: Path, **more: str
) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and two workers, each with room for one job; a worker that is killed is not started again."""
    log = (tmp_path / "dask.log").open("wb")
    address = tmp_path / "scheduler.json"
    env = own_environment(PYTHONPATH=str(project_root), **more)

    def start(*command: str) -> subprocess.Popen[bytes]:
        full = [sys.executable, "-m", "dask", *command, "--scheduler-file", str(address), "--no-dashboard"]
        return subprocess.Popen(full, env=env, cwd=tmp_path, stdout=log, stderr=log)

    processes = [start("scheduler", "--host", "127.0.0.1", "--port", "0")]
    worker = ["worker", "--nthreads", "1", "--no-nanny", "--host", "127.0.0.1", "--resources", "memory=8e9"]
    processes += [start(*worker, "--local-directory", str(tmp_path / f"disk{i}")) for i in range(2)]
    try:
        deadline = time.monotonic() + 60
        while not address.exists():
            assert time.monotonic() < deadline, (tmp_path / "dask.log").read_text()
            time.sleep(0.1)
        yield json.loads(address.read_text())["address"], processes[1:]
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()
        log.close()


def test_results_are_as_of_dvc_repro_and_a_failing_job_fails_alone(tmp_path: Path, project_root: Path) -> None:
    serial, parallel = (make_project(tmp_path / name, "a", "bb", "bad") for name in ("serial", "parallel"))
    assert run(serial, project_root, "dvc", "repro", "evaluate@a", "evaluate@bb")[0] == 0
    status, output = run(parallel, project_root, "facefolds_core", "run", "-j", "3")
    assert status == 1
    assert "evaluate: error: this one is bad" in output
    assert "not found in the cache" not in output
    lines = {line.split()[0]: line.split()[1] for line in output.splitlines() if line[:2] in ("a ", "bb", "ba")}
    assert lines == {"a": "done", "bb": "done", "bad": "failed"}, output
    for name in ("a", "bb", ".config"):
        assert files_of(parallel / "data" / name) == files_of(serial / "data" / name)
    changed = (parallel / "dvc.lock").read_text().replace("parallel-captures", "serial-captures")
    assert yaml.safe_load(changed) == yaml.safe_load((serial / "dvc.lock").read_text())
    assert not [path for path in (parallel / ".dvc" / "cache").iterdir() if path.name.startswith(".")]
    status, output = run(parallel, project_root, "facefolds_core", "run", "--subjects", "a,bb")
    assert status == 0, output
    assert output.count("cached") == 4


@pytest.mark.nightly
def test_a_killed_workers_job_runs_again_elsewhere(tmp_path: Path, project_root: Path) -> None:
    root = make_project(tmp_path / "project", "a", "bb", seconds=8)
    begun = tmp_path / "begun"
    begun.mkdir()
    with dask_cluster(tmp_path, project_root, BEGUN=str(begun)) as (address, workers):
        command = [sys.executable, "-m", "facefolds_core", "run", "--scheduler", address, "--memory", "1GB"]
        process = subprocess.Popen(
            command,
            cwd=root,
            env=own_environment(PYTHONPATH=str(project_root)),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        deadline = time.monotonic() + 60
        while len(list(begun.iterdir())) < 2:
            assert time.monotonic() < deadline
            time.sleep(0.1)
        orphans = psutil.Process(workers[0].pid).children(recursive=True)
        workers[0].kill()
        output, _ = process.communicate(timeout=100)
    assert process.returncode == 0, output
    assert orphans
    assert not psutil.wait_procs(orphans, timeout=5)[1]
    assert len(list(begun.iterdir())) == 3, "one of the two was begun twice"
    assert {path.name for path in (root / "data").glob("*/metrics.json") for path in [path.parent]} == {"a", "bb"}


def test_what_no_worker_has_is_said(tmp_path: Path, project_root: Path) -> None:
    root = make_project(tmp_path / "project", "a")
    status, output = run(root, project_root, "facefolds_core", "run", "--gpu", "64")
    assert status == 1
    assert "no worker has so much gpu" in output


@pytest.mark.nightly
def test_results_travel_through_s3(tmp_path: Path, project_root: Path) -> None:
    for name in ("dvc_s3", "moto", "flask"):
        if find_spec(name) is None:
            pytest.skip(f"no package {name}: pip install -e '.[dev]'")
    import boto3
    from moto.server import ThreadedMotoServer

    root = make_project(tmp_path / "project", "a", "bb")
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    try:
        url = "http://{}:{}".format(*server.get_host_and_port())
        keys = {"AWS_ACCESS_KEY_ID": "x", "AWS_SECRET_ACCESS_KEY": "x", "AWS_DEFAULT_REGION": "us-east-1"}
        client = boto3.client(
            "s3", endpoint_url=url, aws_access_key_id="x", aws_secret_access_key="x", region_name="us-east-1"
        )
        client.create_bucket(Bucket="lab")
        config = root / ".dvc" / "config"
        config.write_text(
            f"{config.read_text()}    remote = lab\n['remote \"lab\"']\n    url = s3://lab/x\n    endpointurl = {url}\n"
        )
        status, output = run(root, project_root, "facefolds_core", "run", "--remote", "-j", "2", **keys)
    finally:
        server.stop()
    assert status == 0, output
    assert "not found in the cache" not in output
    assert (root / "data" / "bb" / "metrics.json").is_file()
    assert not list((root / ".dvc" / "tmp" / "jobs" / "dask-scratch-space").glob("worker-*"))


@pytest.mark.nightly
def test_a_sweep_gives_a_table(tmp_path: Path, project_root: Path) -> None:
    root = make_project(tmp_path / "project", "a")
    (root / "grid.yaml").write_text("decimate.resolution: [8, 16]\n")
    before = (root / "params.yaml").read_bytes()
    status, output = run(root, project_root, "facefolds_core", "run", "--sweep", "grid.yaml", "--out", "t.csv")
    assert status == 0, output
    assert (root / "params.yaml").read_bytes() == before
    header, *rows = (root / "t.csv").read_text().splitlines()
    assert "decimate.resolution" in header
    assert len(rows) == 2
