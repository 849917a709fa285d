"""What a training gives, and how it is written."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from facefolds_core.files.writing import atomic_folder, write_json
from facefolds_core.model.radiance import RadianceManifolds
from facefolds_core.model.storage import Spec, save_model
from facefolds_core.training.report import TrainingReport


@dataclass(frozen=True)
class Trained:
    """A trained model.

    Attributes:
        model: what the export and the evaluation take.
        spec: what `model.json` says of it.
        report: seconds, iterations, PSNR on training rays.
        fit: what was chosen and why (`fit.json`), of models that choose.
    """

    model: RadianceManifolds
    spec: Spec
    report: TrainingReport
    fit: dict[str, Any] | None = None

    def save(self, folder: Path) -> None:
        """Write the model's folder, whole or not at all."""
        with atomic_folder(folder) as temporary:
            save_model(self.model, self.spec, temporary)
            write_json(temporary / "training.json", asdict(self.report))
            if self.fit is not None:
                write_json(temporary / "fit.json", self.fit)
