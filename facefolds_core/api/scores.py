"""Scores of an asset, and of the model that it was made of."""

from __future__ import annotations

import html
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from facefolds_core.api.asset import Asset
from facefolds_core.api.scene import Scene
from facefolds_core.api.work import folders_of, run, set_params
from facefolds_core.asset.manifest_file import MANIFEST_NAME
from facefolds_core.errors import UserError
from facefolds_core.files.writing import read_json
from facefolds_core.scoring.terminal import score_lines


@dataclass(frozen=True, repr=False)
class Scores:
    """What `evaluate` measured on the cameras that did not train; it prints as a table.

    Attributes:
        metrics: metrics.json (docs/reference/metrics.md).
        folder: with `contact_sheet.png`, `per_image.parquet`, films.
    """

    metrics: Mapping[str, Any]
    folder: Path

    def __getitem__(self, metric: str) -> float | None:
        """A metric of the asset, such as "psnr_any"; None where it cannot be had.

        Raises:
            KeyError: if there is no such metric.
        """
        value: float | None = self.metrics["asset"][metric]
        return value

    def __repr__(self) -> str:
        warnings = [str(one.get("words", "")) for one in self.metrics["warnings"]]
        return "\n".join([*score_lines(self.metrics), *warnings])

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(repr(self))}</pre>"


def evaluate(asset: Asset, scene: Scene, **params: Any) -> Scores:
    """Score an asset's files, and the model beside the scene, on the cameras that did not train.

    Args:
        asset: of `Model.export`, or loaded from the folder of the scene.
        scene: that its model was trained on.
        params: keys of the section `evaluate`, such as `films=False` (docs/reference/params.md).

    Raises:
        UserError: if the two do not belong together, no camera is held out, or a key or value is wrong.
    """
    folders = folders_of(scene)
    own, given = folders.asset / MANIFEST_NAME, asset.folder / MANIFEST_NAME
    if not own.is_file() or own.read_bytes() != given.read_bytes():
        raise UserError(
            "the asset and the scene do not belong together",
            file=given,
            expected=f"the asset that was last made of {scene.folder}",
            found="another one" if own.is_file() else "none was made",
            remedy="export the model that was trained on this scene, and pass what export gives",
        )
    set_params(folders, "evaluate", params)
    run("evaluate", folders)
    return Scores(read_json(folders.metrics), folders.evaluation)
