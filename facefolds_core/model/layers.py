"""Stacks of linear layers."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import cast

from torch import nn


class LinearStack(nn.ModuleList):
    """Linear layers of sizes[0] -> sizes[1] -> ...; the user puts the activations between them."""

    def __init__(self, sizes: list[int]) -> None:
        super().__init__(nn.Linear(a, b) for a, b in pairwise(sizes))

    def __iter__(self) -> Iterator[nn.Linear]:
        return cast(Iterator[nn.Linear], super().__iter__())
