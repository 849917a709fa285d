"""What a job finds where its subject's relative paths lead."""

from __future__ import annotations

from pathlib import Path

import pytest

from facefolds_core.cluster.jobs import links_of
from facefolds_core.config.params_file import load_params


@pytest.mark.parametrize(
    ("keys", "linked"),
    [
        ("path: ../capture", ["../capture"]),
        ("path: ../capture, mattes: mine/mattes", ["../capture", "mine/mattes"]),
        ("path: /capture, mattes: /mattes", []),
        ("path: facefolds_core/captures/actor, mattes: mine", ["mine"]),
    ],
)
def test_captures_and_named_mattes_are_linked(tmp_path: Path, keys: str, linked: list[str]) -> None:
    (tmp_path / "params.yaml").write_text(f"subjects:\n  anna: {{source: transforms, {keys}}}\n")
    links = links_of(load_params(tmp_path / "params.yaml"), tmp_path, "anna")
    assert links == tuple((one, str((tmp_path / one).resolve())) for one in linked)
