"""Tables by hand: places between markers, bytes against accuracy, the paper's rows, losses against the clean case."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench.hazard_rows import EXTREME, HAZARDS, loss_of
from bench.results import Cell, Row
from bench.tables import hazard_tables, interpolated, rate_tables, replace_between, sweep_table
from facefolds_core.errors import UserError

GLOSS = next(hazard for hazard in HAZARDS if hazard.key == "gloss")


def test_only_what_is_between_changes(tmp_path: Path) -> None:
    path = tmp_path / "page.md"
    path.write_text("a <1> old <2> b")
    replace_between(path, "<1>", "<2>", "new")
    assert path.read_text() == "a <1>\nnew\n<2> b"


@pytest.mark.parametrize("document", ["", "<1> old", "old <2>", "<2> old <1>"])
def test_a_missing_marker_is_said(tmp_path: Path, document: str) -> None:
    (tmp_path / "page.md").write_text(document)
    with pytest.raises(UserError, match="no place"):
        replace_between(tmp_path / "page.md", "<1>", "<2>", "new")


def test_interpolation_ends_where_points_do() -> None:
    points = [(1.0, 10.0), (3.0, 30.0)]
    assert [interpolated(x, points) for x in (0.9, 1.0, 2.0, 3.1)] == [None, 10.0, 20.0, None]
    assert interpolated(1.0, []) is None


def test_bytes_at_a_quality_and_the_way_back() -> None:
    def point(series: str, size: int, psnr: float) -> Row:
        figures = {"mesh_bytes": size / 2, "texture_bytes": size / 2, "psnr": psnr}
        return Row(sweep=series, subject="a", value=size, params={}, commit="", machine="", figures=figures)

    paper = [point("paper", 10_000, 30.0), point("paper", 4_000, 28.0), point("paper", 1_000, 25.0)]
    smaller, better = rate_tables([*paper, point("h264", 4_000, 30.5), point("h264", 1_000, 28.0)]).split("\n\n")
    assert smaller.splitlines()[3:] == ["| 28.00 dB | 4 kB | 1 kB |", "| 25.00 dB | 1 kB | at most 1 kB |"]
    assert better.splitlines()[2:4] == ["| 10 kB | 30.00 dB | at least 30.50 dB |", "| 4 kB | 28.00 dB | 30.50 dB |"]


def test_a_sweep_stands_beside_the_paper() -> None:
    given = {"sweep": "mesh", "subject": "actor", "params": {}, "commit": "", "machine": ""}
    cost = {"triangles": 1234, "mesh_bytes": 2_500_000, "texture_bytes": 3_000, "gpu_bytes": 9_000_000}
    figures = {**cost, "psnr": 11.0, "psnr_subject": 24.0, "export_seconds": 7.0}
    rows = [Row(**given, value=64, figures=figures), Row(**given, value=32, failure="oh")]
    lines = {line.split("|")[1].strip(): line for line in sweep_table(rows, "mesh", "actor").splitlines()}
    assert lines["64"].startswith("|64|24.00|||1 234|2.50 MB|3 KB|9.00 MB||7|29.49|")
    assert lines["32"].startswith("|32|failed: oh|") and lines["32"].endswith("|29.12|0.831|0.291|9 962|170 KB|")
    assert lines["512"].startswith("|512|not measured|")


def cell(hazard: str, strength: float, psnr: float, seed: int = 0, **more: object) -> Cell:
    views = {"A011": psnr + 0.5, "A023": psnr - 0.5, "+60": psnr - 2, "-60": psnr - 4, "+75": psnr - 4}
    values = {"psnr": psnr, "views": views, "flat": 12.0, "seconds": 5.0, **more}
    return Cell.model_validate({"hazard": hazard, "strength": strength, "preset": "fast", "seed": seed, **values})


def test_losses_are_against_the_same_seed() -> None:
    cells = [cell("clean", 0, 25), cell("clean", 0, 27, seed=1), cell("gloss", 4, 22), cell("gloss", 4, 25, seed=1)]
    loss = loss_of(cells, GLOSS, 4)
    assert loss is not None
    assert (loss.mean, loss.least, loss.most, loss.seeds, loss.failed, loss.astray) == (2.5, 2.0, 3.0, 2, 0, 0)
    assert loss_of(cells, GLOSS, 2) is None


def test_the_worst_view_lost_most_against_itself() -> None:
    worse = cell("gloss", 4, 24)
    worse.views["+75"] -= 3
    loss = loss_of([cell("clean", 0, 25), worse], GLOSS, 4)
    assert loss is not None and (loss.worst, loss.worst_loss) == ("+75", 4.0)


def test_extreme_views_are_the_clean_case_from_aside() -> None:
    loss = loss_of([cell("clean", 0, 25)], EXTREME, 60)
    assert loss is not None and (loss.mean, loss.worst, loss.worst_loss) == (3.0, "-60", 4.0)


def test_failures_and_what_went_astray() -> None:
    failed = Cell(hazard="gloss", strength=4, preset="fast", seed=0, failure="diverged")
    cells = [cell("clean", 0, 25), failed, cell("gloss", 8, 11), cell("gloss", 2, 24)]
    lost = [loss_of(cells, GLOSS, strength) for strength in GLOSS.strengths]
    assert [(loss.mean, loss.failed, loss.astray) for loss in lost if loss] == [(1.0, 0, 0), (None, 1, 0), (14.0, 0, 1)]
    text = hazard_tables(cells)
    assert "|glossy skin|x 2: 1.0|x 4: failed|x 8: 14.0*|1|" in text
    assert "clean 25.00 dB (seeds 25.00; a flat silhouette has 12.00)" in text


def test_a_subject_with_its_whole_budget_has_a_table_of_its_own() -> None:
    given = {"subject": "mugsy", "flat": 0.0}
    text = hazard_tables([cell("clean", 0, 25, **given), cell("gloss", 4, 22, **given), cell("clean", 0, 20)])
    own = "`fast` on `mugsy`, its whole budget: clean 25.00 dB (seeds 25.00)"
    assert text.index("`fast`: clean 20.00") < text.index(own)
    assert "| glossy skin | x 4 | 3.00 |" in text


def test_nothing_measured_is_said() -> None:
    with pytest.raises(UserError, match="nothing measured"):
        hazard_tables([])
