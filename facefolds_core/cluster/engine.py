"""Jobs to a Dask cluster and outcomes back, each as it comes."""

from __future__ import annotations

import logging
import sys
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import dask
import dask.system
import psutil
from distributed import Client, Future, LocalCluster, SSHCluster, as_completed

from facefolds_core.cluster.job import Job, Outcome, do, end_all
from facefolds_core.cluster.project import SETTLED, drop_empty_runs, snapshot
from facefolds_core.errors import UserError

QUEUES = ("slurm", "pbs", "sge", "lsf", "oar", "moab", "htcondor")
"""Job queues that dask-jobqueue speaks to; `~/.config/dask/jobqueue.yaml` says how they are used here."""


SSH = "ssh:"


@contextmanager
def cluster_of(scheduler: str | None, workers: int, root: Path) -> Iterator[Client]:
    """A client of the cluster that was asked for.

    Args:
        scheduler: address of one that runs; one of QUEUES; "ssh:HOST,HOST"; None for this machine.
        workers: jobs at once on this machine or on each of the hosts, or of the queue's jobs.

    Raises:
        UserError: if nobody answers at the address, or a host does not let us in.
    """
    if scheduler is None:
        scratch = root / ".dvc" / "tmp" / "jobs"
        scratch.mkdir(parents=True, exist_ok=True)
        with (
            LocalCluster(
                n_workers=1,
                threads_per_worker=workers,  # a job is a process of its own, and the machine's memory is counted once
                processes=False,
                memory_limit=0,
                resources=resources_here(),
                local_directory=str(scratch),
                dashboard_address="127.0.0.1:0",
            ) as cluster,
            Client(cluster) as client,
        ):
            yield client
    elif scheduler in QUEUES:
        import dask_jobqueue

        kind = next(kind for name, kind in vars(dask_jobqueue).items() if name.lower() == f"{scheduler}cluster")
        with kind() as cluster, Client(cluster) as client:
            cluster.scale(jobs=workers)
            yield client
    elif scheduler.startswith(SSH):
        with _over_ssh(scheduler.removeprefix(SSH).split(","), workers) as cluster, Client(cluster) as client:
            client.wait_for_workers(1)
            yield client
    else:
        try:
            client = Client(scheduler, timeout="20s")
        except (OSError, ValueError) as error:
            raise UserError(
                "no Dask scheduler there",
                found=f"{scheduler}: {error}",
                expected=f"what `dask scheduler` prints (tcp://...), ssh:HOST,HOST, or one of {', '.join(QUEUES)}",
                remedy="start `dask scheduler` and workers (docs/guide/clusters.md), or leave --scheduler out",
            ) from None
        with client:
            yield client


def _over_ssh(hosts: Sequence[str], workers: int) -> Any:
    """A scheduler on the first host, workers on all, as `~/.ssh/config` reaches them, with this Python's path there."""
    options = {"nthreads": workers, "memory_limit": 0, "resources": dask.config.get("distributed.worker.resources", {})}
    try:
        return SSHCluster([hosts[0], *hosts], worker_options=options)
    except Exception as error:  # asyncssh's are many, and Dask wraps some of them in plain ones
        raise UserError(
            "no Dask cluster over SSH",
            found=f"{', '.join(hosts)}: {error or type(error).__name__}",
            expected=f"hosts that SSH reaches without a password, with the project's environment at {sys.prefix}",
            remedy="try `ssh HOST uname`; mend ~/.ssh/config (docs/guide/clusters.md)",
        ) from None


def resources_here() -> dict[str, float]:
    """What jobs on this machine share: bytes of memory, and one GPU where there is one."""
    gpus = 1 if Path("/dev/nvidia0").exists() else 0
    return {"memory": float(psutil.virtual_memory().total), "gpu": float(gpus)}


def default_jobs() -> int:
    """One for two cores."""
    return max(1, dask.system.CPU_COUNT // 2)


def run_jobs(
    client: Client,
    root: Path,
    jobs: Sequence[Job],
    *,
    needs: Mapping[str, float] | None = None,
    remote: bool = False,
    tell: Callable[[Mapping[str, str]], None] = lambda event: None,
) -> Iterator[Outcome]:
    """Run jobs on a cluster; outcomes in the order in which they come.

    A worker that is lost has its job run again elsewhere, three times at most. What is interrupted is ended on the
    workers; finished stages are in the cache.

    Args:
        root: the project's folder.
        needs: of each job: "memory" in bytes, "gpu".
        remote: see `project.snapshot`.
        tell: hears of each stage that begins: job, stage, host.

    Raises:
        UserError: if the project is none, or no worker ever has what a job needs.
    """
    needs = {name: value for name, value in (needs or {}).items() if value}
    _check_needs(client, needs)
    run = f"facefolds-{uuid.uuid4().hex[:12]}"
    project = snapshot(root, run, remote)
    mark = project.cache / project.mark
    mark.parent.mkdir(parents=True, exist_ok=True)
    mark.touch()
    try:
        client.register_plugin(project, name=run)
        client.subscribe_topic(run, lambda event: tell(event[1]))
        futures = {
            client.submit(do, job, run, key=f"{job.name}-{run}", resources=needs or None, pure=False): job
            for job in jobs
        }
        try:
            for future in as_completed(list(futures)):
                yield _outcome(future, futures[future])
        except BaseException:
            logging.getLogger("distributed.worker.state_machine").setLevel(logging.ERROR)  # it warns of what is ended
            client.cancel(list(futures))
            client.run(end_all, run)
            time.sleep(2 * SETTLED)
            drop_empty_runs(project.cache)
            raise
        finally:
            client.unsubscribe_topic(run)
            client.unregister_worker_plugin(name=run)
    finally:
        mark.unlink(missing_ok=True)


def _outcome(future: Future[Any], job: Job) -> Outcome:
    if future.status == "finished":
        outcome: Outcome = future.result()
        return outcome
    error = future.exception()
    if type(error).__name__ == "KilledWorker":
        return Outcome(job, "its workers died, each time: out of memory? `--memory` says what a job needs")
    return Outcome(job, f"{type(error).__name__}: {error}")


def _check_needs(client: Client, needs: Mapping[str, float]) -> None:
    workers: list[Any] = list(client.scheduler_info(n_workers=-1)["workers"].values())
    for name, value in needs.items():
        most = max((worker["resources"].get(name, 0) for worker in workers), default=None)
        if most is not None and most < value:
            raise UserError(
                f"no worker has so much {name}",
                expected=f"{name} {value:g}",
                found=f"{most:g} at most",
                remedy=f'start workers with `dask worker --resources "{name}=..."`, or ask for less',
            )
