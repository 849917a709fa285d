"""Which sources the stage `capture` makes: known without the readers' code, on which that stage does not depend."""

from __future__ import annotations

GENERATED = ("actor",)


def is_generated(source: str) -> bool:
    """Whether the stage `capture` makes the capture, so that it is read from there and not from the subject's path."""
    return source in GENERATED
