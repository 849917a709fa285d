"""Pictures that are worth a look: photo beside asset, what is worst in a frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from facefolds_core.scoring.backgrounds import Patch, WorstPatch
from facefolds_core.scoring.panels import ImageScore, Panel
from facefolds_core.scoring.pictures import write_worst

PHOTO, ASSET = np.full((8, 6, 3), 51 / 255), np.full((8, 6, 3), 102 / 255)


@pytest.mark.parametrize("framed", [True, False])
def test_the_worst_is_photo_beside_asset(tmp_path: Path, framed: bool) -> None:
    score = ImageScore("a", "0", "asset", {"psnr": 20.0})
    panel = Panel("a", "0", PHOTO, ASSET, ASSET, score, score)
    patch = WorstPatch("a", "0", Patch(row=12, column=21, side=4, psnr=9.0), PHOTO, ASSET, (10, 20))
    write_worst(tmp_path / "worst.png", panel, patch if framed else None)
    found = np.asarray(Image.open(tmp_path / "worst.png"))
    assert found.shape == (8, 12, 3)
    white = (found == 255).all(-1)
    assert (np.unique(found[:, :6]).tolist(), np.unique(found[:, 6:]).tolist()) == (
        ([51, 255], [102, 255]) if framed else ([51], [102])
    )
    expected = np.zeros((8, 6), bool)
    expected[2:6, 1:5] = True
    expected[3:5, 2:4] = False
    assert not framed or (white == np.hstack([expected, expected])).all()
    assert (PHOTO == 51 / 255).all()
