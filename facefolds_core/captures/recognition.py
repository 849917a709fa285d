"""What a folder looks like, before anything of it is read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Recognised:
    """What a source module says of a folder that it would read.

    Attributes:
        what: in words, "a Multiface subject with 2 segments".
        path: what `path` of the subject should be: the folder asked about, or the one of its parts that is meant.
        keys: other keys that the subject needs, such as `segment`.
    """

    what: str
    path: Path
    keys: Mapping[str, object] = field(default_factory=dict)
