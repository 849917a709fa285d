"""Text that a command writes between two markers of a document."""

from __future__ import annotations

from facefolds_core.errors import UserError


def replace_between(document: str, start: str, end: str, text: str) -> str:
    """The document with `text` between its markers.

    Raises:
        UserError: if a marker is missing.
    """
    head, found, rest = document.partition(start)
    _, closed, tail = rest.partition(end)
    if not found or not closed:
        raise UserError("no place for a table", expected=f"{start} ... {end}", remedy="put the markers back")
    return f"{head}{start}\n{text}\n{end}{tail}"
