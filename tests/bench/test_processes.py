"""Work in a process of its own: results and errors come back, and it never outlives the one that asked for it."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bench.processes import in_a_process
from facefolds_core.errors import UserError


def die() -> None:
    os._exit(1)


def complain() -> None:
    raise UserError("no such camera")


def linger() -> None:
    print("begun", flush=True)
    time.sleep(600)


def test_a_result_comes_back() -> None:
    assert in_a_process(max, 2, 3) == 3


def test_an_error_comes_back() -> None:
    with pytest.raises(UserError, match="no such camera"):
        in_a_process(complain)


def test_a_process_that_dies_is_an_error() -> None:
    with pytest.raises(UserError, match="died"):
        in_a_process(die)


def test_it_ends_when_the_one_that_asked_is_killed() -> None:
    root = Path(__file__).parents[2]
    call = "from bench.processes import in_a_process as go; from tests.bench.test_processes import linger; go(linger)"
    with subprocess.Popen([sys.executable, "-c", call], cwd=root, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline() == "begun\n"
        parent.kill()
        # Its output ends when the last process that writes to it does.
        assert parent.communicate(timeout=60)[0] == ""
