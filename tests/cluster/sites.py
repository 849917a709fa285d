"""A lab in little: SLURM with one node, and machines that are reached by SSH, all on 127.0.0.1 and of whoever tests."""

from __future__ import annotations

import getpass
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

SLURM = """\
ClusterName=here
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={node}
AuthType=auth/none
CredType=cred/none
SlurmUser={user}
SlurmdUser={user}
StateSaveLocation={place}/state
SlurmdSpoolDir={place}/spool
SlurmctldPidFile={place}/slurmctld.pid
SlurmdPidFile={place}/slurmd.pid
ProctrackType=proctrack/pgid
TaskPlugin=task/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=2000 State=UNKNOWN
PartitionName=normal Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""

SSHD = """\
Port {port}
ListenAddress 127.0.0.1
HostKey {place}/host_key
AuthorizedKeysFile {place}/key.pub
PidFile none
StrictModes no
UsePAM no
PasswordAuthentication no
PermitRootLogin prohibit-password
Subsystem sftp internal-sftp
SetEnv PYTHONPATH={code}
"""


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def program(name: str, package: str) -> str:
    """Where a program lies; the test is skipped, aloud, where it is not."""
    path = shutil.which(name, path="/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin")
    if path is None:
        pytest.skip(f"no {name}: apt-get install {package}")
    return path


@contextmanager
def running(log: Path, *commands: list[str], **environment: str) -> Iterator[None]:
    """Programs that run in the block, and what they say in a file."""
    with log.open("wb") as out:
        started = [subprocess.Popen(c, env=environment or None, stdout=out, stderr=out) for c in commands]
        try:
            yield
        finally:
            for process in reversed(started):
                process.terminate()
            for process in reversed(started):
                try:
                    process.wait(timeout=10)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()


@contextmanager
def slurm(place: Path) -> Iterator[dict[str, str]]:
    """SLURM's controller and one node of two cores; what a user's environment needs to find them."""
    commands = [[program("slurmctld", "slurmctld"), "-D", "-i"], [program("slurmd", "slurmd"), "-D"]]
    sinfo, host = program("sinfo", "slurm-client"), socket.gethostname().split(".")[0]
    for folder in ("state", "spool"):
        (place / folder).mkdir(parents=True)
    ports = {"controller": free_port(), "node": free_port()}
    text = SLURM.format(host=host, user=getpass.getuser(), place=place, **ports)
    (place / "slurm.conf").write_text(text)
    found = {"SLURM_CONF": str(place / "slurm.conf")}
    with running(place / "slurm.log", *commands, **found, PATH="/usr/sbin:/usr/bin:/sbin:/bin"):
        deadline = time.monotonic() + 60
        while subprocess.run([sinfo, "-h", "-o", "%T"], env=found, capture_output=True).stdout.strip() != b"idle":
            assert time.monotonic() < deadline, (place / "slurm.log").read_text()
            time.sleep(0.2)
        yield found
        while subprocess.run([program("squeue", "slurm-client"), "-h"], env=found, capture_output=True).stdout:
            assert time.monotonic() < deadline + 120, "cancelled jobs do not end"
            time.sleep(0.2)


@contextmanager
def ssh(place: Path, *names: str, code: Path) -> Iterator[dict[str, str]]:
    """An SSH server under several names, which the user's `~/.ssh/config` knows; its HOME is in the environment.

    Args:
        code: what the machines import Python's modules from.
    """
    server, keygen = program("sshd", "openssh-server"), program("ssh-keygen", "openssh-client")
    own = place / "home" / ".ssh"
    own.mkdir(parents=True, mode=0o700)
    for key in (place / "key", place / "host_key"):
        subprocess.run([keygen, "-q", "-t", "ed25519", "-N", "", "-f", str(key)], check=True)
    port = free_port()
    (place / "sshd_config").write_text(SSHD.format(port=port, place=place, code=code))
    host_key = " ".join((place / "host_key.pub").read_text().split()[:2])
    (own / "known_hosts").write_text(f"[127.0.0.1]:{port} {host_key}\n")
    known = f"  UserKnownHostsFile {own}/known_hosts\n  IdentityFile {place}/key\n  User {getpass.getuser()}\n"
    (own / "config").write_text(f"Host {' '.join(names)}\n  HostName 127.0.0.1\n  Port {port}\n{known}")
    Path("/run/sshd").mkdir(exist_ok=True)  # a server that root starts looks for it
    with running(place / "sshd.log", [server, "-D", "-e", "-f", str(place / "sshd_config")]):
        deadline = time.monotonic() + 30
        while b"listening" not in (place / "sshd.log").read_bytes():
            assert time.monotonic() < deadline, (place / "sshd.log").read_text()
            time.sleep(0.1)
        yield {"HOME": str(place / "home")}
