"""One function in a fresh process, so that its peak memory is its own."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import TypeVar

from facefolds_core.errors import UserError

T = TypeVar("T")


def in_a_process(function: Callable[..., T], *arguments: object) -> T:
    """Call it in a fresh process, which ends when this one does, however that ends.

    Raises:
        UserError: what it raised, or that the process died (out of memory, for one).
    """
    with ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_end_with_parent) as pool:
        try:
            return pool.submit(function, *arguments).result()
        except BrokenProcessPool:
            raise UserError("the process died", remedy="see whether the machine ran out of memory") from None


def _end_with_parent() -> None:
    """Without this a worker whose parent was killed computes on, and slows whatever is measured next."""
    parent = parent_process()
    assert parent is not None

    def wait() -> None:
        parent.join()
        os._exit(1)

    Thread(target=wait, daemon=True).start()
