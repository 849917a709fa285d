"""A kernel's entry on GPUs with arguments, and what the CPU's kernel makes of the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from facefolds_core.kernels.gpu import Entry, to_gpu


@dataclass(frozen=True)
class Problem:
    """Attributes:
    entry, constants: what is run, by `count` threads.
    arguments: by name, in order; arrays are copied before they are given away.
    outputs: names of the arguments that are compared, and how far they may be off.
    on_cpu: arguments -> nothing: the CPU's kernel, which changes the outputs in place.
    """

    entry: Entry
    count: int
    arguments: dict[str, Any]
    outputs: dict[str, float]
    on_cpu: Callable[[dict[str, Any]], None]
    constants: dict[str, int] = field(default_factory=dict)

    def expected(self) -> dict[str, np.ndarray]:
        given = {name: copied(value) for name, value in self.arguments.items()}
        self.on_cpu(given)
        return {name: given[name] for name in self.outputs}

    def on_gpu(self) -> dict[str, np.ndarray]:
        """On a GPU, or in the simulator."""
        given = {name: there(value) for name, value in self.arguments.items()}
        self.entry.run(self.count, *given.values(), **self.constants)
        return {name: given[name].copy_to_host() for name in self.outputs}


def copied(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(copied(one) for one in value)
    return value.copy() if isinstance(value, np.ndarray) else value


def there(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(there(one) for one in value)
    return to_gpu(value) if isinstance(value, np.ndarray) else value
