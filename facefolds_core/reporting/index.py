"""One page that lists all subjects of a folder, each with what says most of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from facefolds_core.files import write_text
from facefolds_core.paths import SubjectFolders
from facefolds_core.reporting import pictures, words
from facefolds_core.reporting.build import REPORT_NAME, page_environment
from facefolds_core.reporting.facts import finite, read_metrics
from facefolds_core.scoring.terminal import HEADLINE_WORDS


def make_index(data: Path, subjects: Sequence[Path]) -> Path:
    """Write `report.html` into `data`; returns its path.

    Args:
        subjects: folders of subjects that have been evaluated.

    Raises:
        UserError: if a metrics.json is garbled.
    """
    environment = page_environment()
    css = environment.loader.get_source(environment, "report.css")[0] if environment.loader else ""
    rows = [row(folder) for folder in subjects]
    path = data / REPORT_NAME
    write_text(path, environment.get_template("index.html.j2").render(css=Markup(css), rows=rows))
    return path


def row(folder: Path) -> dict[str, Any]:
    """What the page says of one subject."""
    folders = SubjectFolders(folder)
    metrics = read_metrics(folders.metrics)
    asset, cost, key = metrics["asset"], metrics["cost"], words.quality_key(metrics)
    size = sum(finite(cost.get(name)) or 0.0 for name in ("mesh_bytes", "texture_bytes", "reflection_bytes"))
    poster = folders.asset / "poster.jpg"
    return {
        "name": folder.resolve().name,
        "link": f"{folder.name}/{REPORT_NAME}" if (folder / REPORT_NAME).is_file() else None,
        "picture": pictures.jpeg(poster) if poster.is_file() else None,
        "psnr": words.number(asset.get(key)),
        "what": HEADLINE_WORDS[key],
        "temporal": words.percent(asset.get("temporal"), 0),
        "bytes": words.size(size or None),
        "triangles": words.count(cost.get("triangles")),
        "seconds": words.duration(cost.get("train_seconds")),
        "warnings": len(metrics.get("warnings") or ()),
    }
