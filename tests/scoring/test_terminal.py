"""The lines at the end of `evaluate`."""

from __future__ import annotations

from pathlib import Path

from facefolds_core.facts import fact
from facefolds_core.files.paths import SubjectFolders
from facefolds_core.scoring.panels import ALL_METRICS, VARIANTS, ImageScore
from facefolds_core.scoring.report import metrics_json
from facefolds_core.scoring.terminal import result_lines, score_lines
from tests.scoring.fakes import evaluation

COST = {"mesh_bytes": 200_000, "texture_bytes": 300_000, "reflection_bytes": 0}


def metrics(diffuse: float = 30.0, subject: str = "anna") -> dict[str, object]:
    given = {"model": 30.0, "diffuse": diffuse, "asset": 29.0, "asset_diffuse": 29.0}
    scores = [
        ImageScore("a", "0", v, dict.fromkeys(ALL_METRICS) | {"psnr": 10.0, "psnr_subject": given[v]}) for v in VARIANTS
    ]
    return metrics_json(subject, evaluation(scores), COST, [fact("front_is_guessed")])


def test_what_nothing_has_is_left_out_and_the_whole_frame_comes_last() -> None:
    lines = score_lines(metrics())
    assert [line.split("  ")[0] for line in lines][1:] == [
        "PSNR of the subject, dB",
        "PSNR of the whole frame, without the room",
    ]
    assert len({len(line) for line in lines}) == 1  # aligned


def test_a_model_without_a_view_branch_is_one_column() -> None:
    assert score_lines(metrics())[0].split()[-2:] == ["model", "asset"]
    assert score_lines(metrics(diffuse=29.5))[0].split()[-4:] == ["model", "no", "gloss", "asset"]


def test_the_end_says_where_what_how_good_and_how_to_look(tmp_path: Path) -> None:
    text = "\n".join(result_lines(metrics(), SubjectFolders(tmp_path / "anna")))
    folder = tmp_path / "anna" / "asset"
    assert f"anna: {folder}, 0.50 MB, 29.00 dB of the subject" in text
    assert f"make view ASSET={folder}" in text
    assert text.index("what is not well (1)") < text.index("0.50 MB")
    assert "name a camera that faces" in text
