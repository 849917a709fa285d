"""Options that take numbers: `nan` and `inf` are none."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from facefolds_core.cli import app

OPTIONS = {
    "recommend": ["--max-bytes", "--max-triangles", "--max-gpu-bytes", "--max-bit-rate", "--min-psnr"],
}


@pytest.mark.parametrize(("command", "option"), [(c, o) for c, options in OPTIONS.items() for o in options])
@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
def test_no_number(command: str, option: str, value: str) -> None:
    result = CliRunner().invoke(app, [command, "table.csv", option, value])
    assert result.exit_code == 2
    assert option in result.output
    assert "finite" in result.output
