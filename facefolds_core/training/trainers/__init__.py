"""The models that `train` fits, one module each: its keys, what is written of it, and what trains it.

A module's name is that of its model. It has

- `Params`, a `Section` whose key `model` is `Literal[NAME] = NAME`, with `preset`, `seed` and what else it needs;
- `PRESETS`: name -> the values that differ from the defaults;
- `spec()`: the pydantic model of `model.json`, with `kind: Literal[NAME] = NAME`;
- `build(spec)`: an untrained `RadianceManifolds`;
- `train(scene, params, folder, checkpoints, log)`: trains it, writes its folder and returns a `TrainingReport`.

Parameters are checked without torch, so a module imports no more than params at its top, and the rest within the
functions: a stage's digest counts what the functions that it calls import (source_code.py).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import facefolds_core.params  # noqa: F401  (which imports the models: whoever comes first, they are whole)
from facefolds_core.registry import MODELS

if TYPE_CHECKING:
    from facefolds_core.captures.scene import Scene
    from facefolds_core.params import TrainParams
    from facefolds_core.training.report import TrainingReport


def train(scene: Scene, params: TrainParams, folder: Path, checkpoints: Path, log: Path) -> TrainingReport:
    """Train the model that the parameters are of, and write its folder, whole.

    Args:
        checkpoints, log: folders, of what lasts as long as the training and of dvclive's files.
    """
    report: TrainingReport = MODELS[params.model].train(scene, params, folder, checkpoints, log)
    return report
