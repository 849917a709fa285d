"""One page that lists all subjects of a folder: how far each has come, and what says most of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from markupsafe import Markup

from facefolds_core.files import write_text
from facefolds_core.paths import SubjectFolders
from facefolds_core.reporting import pictures, words
from facefolds_core.reporting.build import REPORT_NAME, page_environment
from facefolds_core.reporting.facts import STAGE_OUTPUTS, finite, read_metrics, stage_cost
from facefolds_core.scoring.terminal import HEADLINE_WORDS


def make_index(data: Path) -> Path:
    """Write `report.html` into `data`, with every subject that is configured or has scores; returns its path.

    Raises:
        UserError: if a metrics.json is garbled.
    """
    environment = page_environment()
    css = environment.loader.get_source(environment, "report.css")[0] if environment.loader else ""
    rows = [
        row(data / name)
        for name in sorted({path.parent.name for path in data.glob("*/metrics.json")} | configured(data))
    ]
    path = data / REPORT_NAME
    write_text(path, environment.get_template("index.html.j2").render(css=Markup(css), rows=rows))
    return path


def configured(data: Path) -> set[str]:
    """Subjects that `configure` has found in params.yaml."""
    return {path.parent.name for path in (data / ".config").glob("*/entry.json")}


def row(folder: Path) -> dict[str, Any]:
    """What the page says of one subject; of one without scores, how far it is."""
    folders = SubjectFolders(folder)
    costs = [stage_cost(folders, stage) for stage in STAGE_OUTPUTS]
    ran = [cost.name for cost in costs if cost.seconds is not None]
    whole = words.duration(sum(cost.seconds or 0.0 for cost in costs) or None)
    if not folders.metrics.exists():
        state = f"made up to {ran[-1]}" if ran else "not begun"
        blank = dict.fromkeys(("link", "picture", "warnings"))
        figures = dict.fromkeys(("psnr", "what", "temporal", "bytes", "triangles", "seconds"), words.NONE)
        return {**blank, **figures, "name": folder.name, "state": state, "whole": whole}
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
        "whole": whole,
        "state": "evaluated",
        "warnings": len(metrics.get("warnings") or ()),
    }
