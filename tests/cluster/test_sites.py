"""`facefolds run` on a queue, over SSH, and through an SSH remote: SLURM and OpenSSH as Debian has them."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from facefolds_core.cluster.engine import cluster_of
from facefolds_core.errors import UserError
from tests.cluster.sites import slurm, ssh
from tests.cluster.small import make_project
from tests.cluster.test_run import files_of, run

pytestmark = pytest.mark.pipeline

JOBQUEUE = """\
jobqueue:
  slurm:
    cores: 1
    processes: 1
    memory: 500MB
    queue: normal
    walltime: "00:10:00"
    interface: lo
    local-directory: {scratch}
    log-directory: {scratch}
    worker-extra-args: ["--resources", "memory=1e9"]
"""


@pytest.mark.nightly
def test_subjects_are_jobs_of_slurm(tmp_path: Path, project_root: Path) -> None:
    root, here = (make_project(tmp_path / name, "a", "bb") for name in ("project", "here"))
    scratch, config = tmp_path / "scratch", tmp_path / "dask"
    for folder in (scratch, config):
        folder.mkdir()
    (config / "jobqueue.yaml").write_text(JOBQUEUE.format(scratch=scratch))
    command = ["facefolds_core", "run", "--scheduler", "slurm", "-j", "2", "--memory", "1GB"]
    with slurm(tmp_path / "slurm") as found:
        status, output = run(root, project_root, *command, **found, DASK_CONFIG=str(config))
    assert status == 0, output
    assert "not found in the cache" not in output
    assert run(here, project_root, "dvc", "repro")[0] == 0
    assert files_of(root / "data") == files_of(here / "data")
    assert (tmp_path / "slurm" / "slurm.log").read_text().count("Allocate JobId=") == 2, "two jobs of the queue"


@pytest.mark.nightly
def test_subjects_run_on_machines_reached_by_ssh(tmp_path: Path, project_root: Path) -> None:
    root = make_project(tmp_path / "project", "a", "bb")
    with ssh(tmp_path / "ssh", "one", "two", code=project_root) as found:
        status, output = run(root, project_root, "facefolds_core", "run", "--scheduler", "ssh:one,two", **found)
        assert (tmp_path / "ssh" / "sshd.log").read_text().count("Accepted publickey") == 3  # a scheduler, two workers
    assert status == 0, output
    assert "not found in the cache" not in output
    assert (root / "data" / "bb" / "metrics.json").is_file()


@pytest.mark.nightly
def test_results_travel_through_ssh(tmp_path: Path, project_root: Path) -> None:
    if find_spec("dvc_ssh") is None:
        pytest.skip("no package dvc_ssh: pip install -e '.[dev]'")
    root = make_project(tmp_path / "project", "a", "bb")
    config = root / ".dvc" / "config"
    remote = f"    remote = lab\n['remote \"lab\"']\n    url = ssh://one{tmp_path}/store\n"
    config.write_text(config.read_text() + remote)
    with ssh(tmp_path / "ssh", "one", code=project_root) as found:
        status, output = run(root, project_root, "facefolds_core", "run", "--remote", "-j", "2", **found)
    assert status == 0, output
    assert "not found in the cache" not in output
    assert (root / "data" / "bb" / "metrics.json").is_file()
    assert list((tmp_path / "store" / "files" / "md5").glob("??/*"))


def test_a_host_that_is_none_is_said(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="over SSH") as caught, cluster_of("ssh:no.such.host.invalid", 1, tmp_path):
        pass
    assert "no.such.host.invalid" in str(caught.value.found)
