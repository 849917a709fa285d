"""What is said of a training that ended well but is not well."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from facefolds_core.facts import fact
from facefolds_core.geometry.chart import Chart
from facefolds_core.subject.volume import Volume
from facefolds_core.training.explicit.fit import Fit
from facefolds_core.training.explicit.loop import warnings_of
from facefolds_core.training.explicit.offsets import Offsets
from tests.scenes import make_scene

EMPTY = Volume(np.zeros((2, 2, 2, 4), np.float32), np.zeros(3), 1.0)
BACK, FARTHER = Chart((-0.3, 0.0, 0.0)), Chart((-0.4, 0.0, 0.0))

WELL = Fit(
    chart=BACK,
    window=(-0.5, 0.5, -0.5, 0.5),
    offsets=Offsets(np.zeros((2, 2, 2)), np.zeros((2, 2, 2))),
    halfwidth=np.zeros((2, 2)),
    reach=np.zeros((2, 2)),
    second=np.zeros((2, 2)),
    trust=np.zeros((2, 2)),
    rgb=np.zeros((2, 2, 3)),
    texels=(16, 16),
    reasons=(),
    notes=(),
    volume=EMPTY,
    losses={BACK: 0.02, FARTHER: 0.3},
    start_psnr=30.0,
)


def test_what_is_not_well_is_said_with_a_remedy(tmp_path: Path) -> None:
    scene = make_scene(tmp_path, size=16)
    assert warnings_of(scene, WELL) == ()
    (low,) = warnings_of(scene, replace(WELL, start_psnr=20.1))
    assert low.kind == "start_explains_little" and "20.1 dB" in str(low) and "sheet.png" in str(low)
    (lost,) = warnings_of(scene, replace(WELL, chart=FARTHER))
    assert "30%" in str(lost) and "train.start.centres" in str(lost)
    guessed = replace(scene, left_out=(fact("front_found", camera="a", share=0.5),))
    assert "`front`" in str(warnings_of(guessed, WELL)[0])
