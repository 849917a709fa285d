"""Text between markers of a document."""

import pytest

from bench.markers import replace_between
from facefolds_core.errors import UserError


def test_only_what_is_between_changes() -> None:
    assert replace_between("a <1> old <2> b", "<1>", "<2>", "new") == "a <1>\nnew\n<2> b"


@pytest.mark.parametrize("document", ["", "<1> old", "old <2>", "<2> old <1>"])
def test_a_missing_marker_is_said(document: str) -> None:
    with pytest.raises(UserError, match="no place"):
        replace_between(document, "<1>", "<2>", "new")
