"""The matrix: planned, resumed, kept; its losses from closed-form results; its pictures."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from bench import stress, stress_cells
from bench.stress_cells import CLEAN, Cell, keep_cell, plan_cells, read_cells, save_strip, strip_path
from bench.stress_draw import draw_heat_map, draw_worst, panels
from bench.stress_hazards import HAZARDS, Hazard
from bench.stress_tables import EXTREME, loss_of, table
from facefolds_core.errors import UserError

GLOSS = next(hazard for hazard in HAZARDS if hazard.key == "gloss")


def cell(hazard: str, strength: float, psnr: float, seed: int = 0, preset: str = "fast", **more: object) -> Cell:
    views = {"A011": psnr, "A023": psnr - 1, "+60": psnr - 2, "-60": psnr - 4}
    views |= {"+75": psnr - 4, "-75": psnr - 6, "+85": psnr - 8, "-85": psnr - 8}
    values = {"views": views, "flat": 12.0, "seconds": 5.0, **more}
    return Cell(hazard=hazard, strength=strength, preset=preset, seed=seed, **values)  # type: ignore[arg-type]


def test_the_clean_case_and_the_middle_strength_come_first() -> None:
    planned = plan_cells(["gloss"], ["fast", "paper"], 2)
    assert [c.key for c in planned[:4]] == [
        ("clean", 0.0, "fast", 0),
        ("gloss", 4, "fast", 0),
        ("gloss", 8, "fast", 0),
        ("gloss", 2, "fast", 0),
    ]
    assert len({c.key for c in planned}) == len(planned) == 16 and planned[8].seed == 1
    assert len(plan_cells([], ["fast"], 1)) == 1 + 3 * len(HAZARDS)


def test_an_unknown_row_is_named() -> None:
    with pytest.raises(UserError, match="no such row"):
        plan_cells(["rain"], ["fast"], 1)


def test_cells_replace_themselves(tmp_path: Path) -> None:
    path = tmp_path / "new" / "cells.json"
    keep_cell(path, cell("gloss", 2, 20))
    keep_cell(path, cell("gloss", 4, 19))
    keep_cell(path, cell("gloss", 2, 21))
    assert [(c.strength, c.inner) for c in read_cells(path)] == [(4, 18.5), (2, 20.5)]


def test_a_garbled_file_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "cells.json"
    path.write_text('{"version": 1, "cells": [{"hazard": "gloss"}]}')
    with pytest.raises(UserError, match="garbled"):
        read_cells(path)


def test_a_run_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[tuple[str, float, str, int]] = []

    def measured(blank: Cell, *_: Path) -> Cell:
        made.append(blank.key)
        if len(made) == 3:
            raise KeyboardInterrupt
        return cell(*blank.key[:2], 20.0, blank.seed, blank.preset)

    monkeypatch.setattr(stress, "run_cell", measured)
    monkeypatch.setattr(stress, "HEAT_MAP", tmp_path / "map.png")
    monkeypatch.setattr(stress, "WORST", tmp_path / "worst.jpg")
    monkeypatch.setattr(stress, "PAGE", tmp_path / "page.md")
    (tmp_path / "page.md").write_text(f"before\n{stress.START}\nold\n{stress.END}\nafter\n")
    app = typer.Typer()
    app.command()(stress.main)
    arguments = ["--only", "gloss", "--presets", "fast", "--seeds", "1", "--results", str(tmp_path / "cells.json")]
    arguments += ["--data", str(tmp_path)]
    CliRunner().invoke(app, arguments)
    assert len(read_cells(tmp_path / "cells.json")) == 2
    assert CliRunner().invoke(app, arguments).exit_code == 0
    assert made == [made[0], made[1], made[2], made[2], ("gloss", 2, "fast", 0)]
    CliRunner().invoke(app, [*arguments, "--draw-only", "--force"])
    assert len(made) == 5 and (tmp_path / "map.png").exists()
    page = (tmp_path / "page.md").read_text()
    assert page.startswith("before\n") and page.endswith("after\n") and "glossy skin" in page and "old" not in page


def test_losses_are_against_the_same_seed() -> None:
    cells = [cell("clean", 0, 25), cell("clean", 0, 27, seed=1), cell("gloss", 4, 22), cell("gloss", 4, 25, seed=1)]
    loss = loss_of(cells, GLOSS, 4, "fast")
    assert loss is not None
    assert (loss.mean, loss.least, loss.most, loss.seeds, loss.failed, loss.astray) == (2.5, 2.0, 3.0, 2, 0, 0)
    assert loss_of(cells, GLOSS, 2, "fast") is None and loss_of(cells, GLOSS, 4, "paper") is None


def test_the_worst_view_lost_most_against_itself() -> None:
    worse = cell("gloss", 4, 24)
    worse.views["+75"] -= 3
    loss = loss_of([cell("clean", 0, 25), worse], GLOSS, 4, "fast")
    assert loss is not None and (loss.worst, loss.worst_loss) == ("+75", 4.0)


def test_extreme_views_are_the_clean_case_from_aside() -> None:
    loss = loss_of([cell("clean", 0, 25)], EXTREME, 60, "fast")
    assert loss is not None
    # Inside 25 and 24; at 60 degrees 23 and 21.
    assert (loss.mean, loss.worst, loss.worst_loss) == (2.5, "-60", 3.5)


def test_failures_and_what_went_astray() -> None:
    failed = Cell(hazard="gloss", strength=4, preset="fast", seed=0, failure="diverged")
    cells = [cell("clean", 0, 25), failed, cell("gloss", 8, 11), cell("gloss", 2, 24, restarts=1)]
    lost = [loss_of(cells, GLOSS, strength, "fast") for strength in GLOSS.strengths]
    assert [(loss.mean, loss.failed, loss.astray) for loss in lost if loss] == [(1.0, 0, 1), (None, 1, 0), (14.0, 0, 1)]
    text = table(cells, ["fast"])
    assert "| glossy skin | x 2: 1.0* | x 4: failed | x 8: 14.0* | 1 |" in text
    assert "clean 24.50 dB (seeds 24.50; a flat silhouette has 12.00)" in text


def test_nothing_measured_is_said() -> None:
    with pytest.raises(UserError, match="nothing measured"):
        table([], ["fast"])


def test_pictures(tmp_path: Path) -> None:
    clean, worse = cell(CLEAN.key, 0, 25), cell("gloss", 8, 20)
    for number, one in enumerate((clean, worse)):
        pairs = [(np.full((6, 4, 3), 0.1 * k + 0.001), np.full((6, 4, 3), 0.1 * k + 0.1 * number)) for k in range(8)]
        save_strip(strip_path(tmp_path, one), pairs)
    truth, shown = panels(strip_path(tmp_path, worse), 3, 8)
    assert truth.shape == shown.shape == (6, 4, 3)
    assert (int(truth[0, 0, 0]), int(shown[0, 0, 0])) == (77, 102)
    draw_heat_map([clean, worse], ["fast"], tmp_path / "map.png")
    draw_worst([clean, worse], "fast", tmp_path, tmp_path / "worst.jpg")
    assert all(cv2.imread(str(tmp_path / name)) is not None for name in ("map.png", "worst.jpg"))


def test_a_failed_training_is_a_cell(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def diverge(*_: object) -> None:
        raise UserError("training diverged", remedy="none")

    monkeypatch.setattr(stress_cells, "disturbed", lambda *_: (None, None))
    monkeypatch.setattr(stress_cells, "write_shots", lambda *_: None)
    monkeypatch.setattr(stress_cells, "_train", diverge)
    made = stress_cells.run_cell(Cell(hazard="gloss", strength=4, preset="fast", seed=0), tmp_path, tmp_path)
    assert made.failure.endswith("training diverged") and made.inner is None and not made.converged


def test_the_seed_draws_the_hazard_and_the_world_moves_as_one(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[float] = []

    def world(shots: object, strength: float, random: np.random.Generator) -> object:
        drawn.append(float(random.random()))
        return shots

    monkeypatch.setattr(stress_cells, "shoot", lambda *_: None)
    monkeypatch.setattr(stress_cells, "training", lambda shots: shots)
    monkeypatch.setattr(stress_cells, "held_out", lambda shots: shots)
    hazard = Hazard("x", "x", (1, 2, 3), "{}", world=world)  # type: ignore[arg-type]
    for seed in (0, 0, 1):
        stress_cells.disturbed(hazard, 1.0, seed, Path())
    assert drawn[0] == drawn[1] == drawn[2] == drawn[3] != drawn[4] == drawn[5]
