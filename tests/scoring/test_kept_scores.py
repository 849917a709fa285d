"""Pictures that are the same to the bit have their scores of an earlier run, and only these."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import pytest

from facefolds_core.asset import Asset
from facefolds_core.params import EvaluateParams
from facefolds_core.scoring import evaluation
from facefolds_core.scoring.evaluation import Evaluation, evaluate
from facefolds_core.scoring.images import score_renderings
from facefolds_core.scoring.perceptual import Perceptual
from tests.scoring.fakes import FRAMES, FlatAsset, flat_scene, half_mask, pictures, tiny_model


class Counted:
    """Evaluations that count the pictures which are measured."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.measured = 0
        self.kept = folder / "kept" / "scores.npz"
        self._scene = flat_scene(folder, masks={0: half_mask()})

        def measure(*arguments: object) -> object:
            self.measured += 1
            return score_renderings(*arguments)  # type: ignore[arg-type]

        monkeypatch.setattr(evaluation, "score_renderings", measure)

    def run(self, changed: int = -1, kept: bool = True, **params: object) -> Evaluation:
        """With a frame of the asset that shows something else."""
        shown = pictures()
        shown[changed if changed >= 0 else 0, 0, 0] ^= 8 if changed >= 0 else 0
        self.measured = 0
        asset = cast(Asset, FlatAsset(shown))
        chosen = EvaluateParams(**params)  # type: ignore[arg-type]
        metrics = Perceptual(None, None, ())
        return evaluate(self._scene, tiny_model(), asset, chosen, metrics, kept=self.kept if kept else None)


@pytest.fixture
def counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Counted:
    return Counted(tmp_path, monkeypatch)


def test_a_changed_frame_alone_is_measured(counted: Counted) -> None:
    first = counted.run()
    assert counted.measured == FRAMES
    again = counted.run()
    assert counted.measured == 0
    assert again.scores == first.scores
    after = counted.run(changed=1)
    assert counted.measured == 1
    assert after.scores == counted.run(changed=1, kept=False).scores
    assert after.scores != first.scores


def test_with_other_settings_all_are_measured(counted: Counted) -> None:
    counted.run()
    counted.run(background=(0.5, 0.5, 0.5))
    assert counted.measured == FRAMES


def test_damaged_scores_are_measured_again(counted: Counted) -> None:
    first = counted.run()
    content = counted.kept.read_bytes()
    counted.kept.write_bytes(content[: len(content) // 2])
    assert counted.run().scores == first.scores
    assert counted.measured == FRAMES
