"""Where each stage's files lie: `data/<subject>/...`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class SubjectFolders:
    """Paths of one subject's files.

    Attributes:
        root: `data/<subject>`.
    """

    root: Path

    @property
    def config(self) -> Path:
        """configure: one JSON a stage."""
        return self.root / "config"

    @property
    def capture(self) -> Path:
        """capture: the embedded actor in the Multiface layout; for other sources only `source.json`."""
        return self.root / "capture"

    @property
    def scene(self) -> Path:
        """normalize: the normalised scene (captures/scene.py)."""
        return self.root / "scene"

    @property
    def model(self) -> Path:
        """train: `model.safetensors`, `model.json`, `training.json`."""
        return self.root / "model"

    @property
    def checkpoints(self) -> Path:
        """train, while it runs: not an output of any stage, so that an interrupted run finds it again."""
        return self.root / "checkpoints"

    @property
    def training_log(self) -> Path:
        """train: dvclive's folder."""
        return self.root / "training"

    @property
    def samples(self) -> Path:
        """sample: `grids.npz` and `textures.arrow`."""
        return self.root / "samples"

    @property
    def surfaces(self) -> Path:
        """reconstruct: `surfaces.npz`."""
        return self.root / "surfaces"

    @property
    def meshes(self) -> Path:
        """decimate: `meshes.npz`."""
        return self.root / "meshes"

    @property
    def resampled(self) -> Path:
        """texture: `textures.arrow`."""
        return self.root / "resampled"

    @property
    def textures(self) -> Path:
        """bake: `textures.arrow`, which ship."""
        return self.root / "textures"

    @property
    def asset(self) -> Path:
        """compress: what ships."""
        return self.root / "asset"

    @property
    def glb(self) -> Path:
        """compress: one frame of the asset as binary glTF."""
        return self.root / "asset.glb"

    @property
    def evaluation(self) -> Path:
        """evaluate: `per_image.parquet`, `contact_sheet.png`, `analysis.json` and its `pictures`."""
        return self.root / "evaluation"

    @property
    def metrics(self) -> Path:
        return self.root / "metrics.json"

    def timing(self, stage: str) -> Path:
        """Seconds that a stage took, read by evaluate."""
        return self.root / "timings" / f"{stage}.json"
