"""A DVC project with the real stages and a take that is trained in segments."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import yaml

PARAMS: dict[str, Any] = {
    "subjects": {"take": {"source": "actor", "path": "facefolds_core/captures/actor", "holdout": {"every": 4}}},
    "capture": {"cameras": 8, "frames": 6, "height": 48, "width": 32, "mattes": True},
    "normalize": {},
    "subject": {"iterations": 100},
    "train": {
        "preset": "fast",
        "layers": 3,
        "iterations": 60,
        "textures": {"steps_per_frame": 8},
        "segments": {"joint_frames": 0, "key_frames": 2, "frames": 2, "steps": 1000, "checkpoint_seconds": 0.2},
    },
    **{stage: {} for stage in ("sample", "reconstruct", "decimate", "texture", "bake", "compress", "evaluate")},
}
"""Steps enough that there is time to kill a worker in mid-segment."""


def make_take(root: Path, project: Path) -> Path:
    """Write it to `root`; its code is that of `project`."""
    (root / ".dvc").mkdir(parents=True)
    (root / ".dvc" / "config").write_text("[core]\n    analytics = false\n    no_scm = true\n")
    for name in ("facefolds_core", "stages"):
        (root / name).symlink_to(project / name)
    for name in ("dvc.yaml", ".dvcignore"):
        shutil.copy(project / name, root / name)
    (root / "params.yaml").write_text(yaml.safe_dump(PARAMS, sort_keys=False))
    return root
