"""Tables and charts of the sweeps, beside the paper's points."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bench.paper import PAPER, total_bytes
from bench.plots_page import PLACEHOLDERS
from bench.sweep_chart import draw, write_plot_data
from bench.sweep_rows import Name, Row, add_row, read_rows, table, with_tables
from facefolds_core.errors import UserError


def row(sweep: Name, value: int, psnr: float, size: int, subject: str = "actor", failure: str = "") -> Row:
    cost = {"triangles": 10 * size, "mesh_bytes": size, "texture_bytes": size, "gpu_bytes": 5 * size}
    scores: dict[str, float | None] = {"psnr": 10.0, "psnr_subject": psnr, "ssim": 0.5, "st_lpips": None}
    return Row(
        sweep=sweep,
        subject=subject,
        value=value,
        params={},
        key="0",
        commit="abc",
        machine="one",
        scores={} if failure else scores,
        cost={} if failure else cost,
        pictures_a_second=0.0 if failure else 20_000 / size,
        renderer="a card",
        export_seconds=12.0,
        failure=failure,
        date="2026-01-01T00:00:00+00:00",
    )


ROWS = [
    row("mesh", 64, 24.0, 2000),
    row("mesh", 8, 20.0, 1000),
    row("mesh", 32, 0.0, 0, failure="out of memory"),
    row("texture", 256, 23.0, 3000),
    row("layers", 4, 22.0, 1500),
]


def test_the_papers_totals() -> None:
    assert total_bytes("mesh", PAPER["mesh"][-1]) == pytest.approx(5.911e6)
    assert total_bytes("texture", PAPER["texture"][2]) == pytest.approx(118.767e6)
    assert total_bytes("layers", PAPER["layers"][0]) == pytest.approx(125.1e6)


def test_a_table_has_ours_and_the_papers_rows() -> None:
    lines = table(ROWS, "mesh", "actor").splitlines()
    assert len(lines) == 2 + 7
    assert (
        lines[2]
        == "| 512 | not measured |  |  |  |  |  |  |  |  |  |  |  | 30.10 | 0.858 | 0.284 | 6 261 920 | 118.1 MB |"
    )
    assert lines[5] == (
        "| 64 | 24.00 |  |  | 10.00 | 0.500 |  | 20 000 | 2 KB | 2 KB | 10 KB | 10.0 | 12 "
        "| 29.49 | 0.837 | 0.289 | 43 224 | 721 KB |"
    )
    assert lines[6].startswith("| 32 | failed: out of memory |")
    assert {line.count("|") for line in lines} == {19}
    assert [line.split("|")[1].strip() for line in table(ROWS, "layers", "actor").splitlines()[2:]] == ["12", "4", "1"]


def test_tables_go_between_their_markers() -> None:
    marks = "".join(
        f"<!-- {name}: written by bench/sweeps.py draw -->\nold\n<!-- end of {name} -->\n"
        for name in ("layers", "mesh", "texture")
    )
    text = with_tables(f"before\n{marks}after\n", ROWS)
    assert text.startswith("before\n") and text.endswith("after\n") and "old" not in text
    assert with_tables(text, ROWS) == text
    with pytest.raises(UserError, match="no place"):
        with_tables("nothing", ROWS)


def test_a_cell_has_one_row(tmp_path: Path) -> None:
    path = tmp_path / "rows.json"
    for each in (*ROWS, row("mesh", 8, 21.0, 1000)):
        add_row(path, each)
    found = read_rows(path)
    assert len(found) == len(ROWS)
    assert [r.score("psnr") for r in found if (r.sweep, r.value) == ("mesh", 8)] == [21.0]


def test_garbled_rows(tmp_path: Path) -> None:
    for text in ("{}", '{"version": 2, "rows": []}', '{"version": 1, "rows": [{}]}', "nothing"):
        (tmp_path / "rows.json").write_text(text)
        with pytest.raises(UserError):
            read_rows(tmp_path / "rows.json")


def test_pictures_and_plot_data_come_out(tmp_path: Path) -> None:
    rows = [*ROWS, row("mesh", 16, 30.0, 500, subject="mugsy")]
    draw(rows, tmp_path / "chart.png")
    draw(rows, tmp_path / "chart.svg")
    write_plot_data(rows, tmp_path)
    assert (tmp_path / "chart.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "chart.svg").read_text()
    points = json.loads((tmp_path / "sweeps_bytes.json").read_text())
    ringed = {(p["subject"], p["series"], p["value"]) for p in points if p["frontier"]}
    assert ringed == {("actor", "mesh", 8), ("actor", "layers", 4), ("actor", "mesh", 64), ("mugsy", "mesh", 16)}
    speeds = json.loads((tmp_path / "sweeps_pictures_a_second.json").read_text())
    assert {(p["subject"], p["value"]) for p in speeds if p["frontier"]} == {
        ("actor", 8),
        ("actor", 4),
        ("actor", 64),
        ("mugsy", 16),
    }
    published = [p for p in points if p["series"].startswith("paper") and p["subject"] == "actor"]
    assert len(published) == sum(len(points) for points in PAPER.values())
    with pytest.raises(UserError, match="nothing measured"):
        draw(ROWS[2:3], tmp_path / "none.png")


def test_the_page_of_plots_needs_no_network(project_root: Path) -> None:
    page = (project_root / ".dvc" / "plots_page.html").read_text()
    assert [page.count(placeholder) for placeholder in PLACEHOLDERS] == [0, 1, 1]
    assert "vegaEmbed" in page and "<script src" not in page and "<link" not in page
    assert "html_template = plots_page.html" in (project_root / ".dvc" / "config").read_text()
