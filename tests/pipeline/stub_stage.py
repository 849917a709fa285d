"""A stand-in for a stage of the pipeline: it makes the outputs that dvc.yaml lists, of a digest of the dependencies.

It tells RAN that it ran, fails where a texture resolution of 13 is asked for, and "measures" with closed formulas.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from pathlib import Path

import yaml


def main() -> None:
    stage, subject = os.environ["DVC_STAGE"].split("@")
    with Path(os.environ["RAN"]).open("a") as file:
        file.write(f"{stage}\n")
    config = Path("data", ".config", subject)
    resolution = {
        name: json.loads((config / f"{name}.json").read_text())["resolution"] for name in ("decimate", "texture")
    }
    auto = {"decimate": 64, "texture": 256}
    resolution = {name: auto[name] if value == "auto" else value for name, value in resolution.items()}
    if stage == "texture" and resolution["texture"] == 13:
        sys.exit("texture: error: 13 is unlucky")
    stages = yaml.safe_load(Path("dvc.yaml").read_text().replace("${key}", subject))["stages"]
    del stages["configure"]
    wanted = {dep for other in stages.values() for dep in other["do"]["deps"]}
    deps = sorted(dep for dep in stages[stage]["do"]["deps"] if dep.startswith("data/"))
    digest = hashlib.sha256()
    for path in (file for dep in deps for file in sorted([Path(dep), *Path(dep).rglob("*")]) if file.is_file()):
        digest.update(path.read_bytes())
    for out in stages[stage]["do"]["outs"]:
        inside = {dep for dep in wanted if dep.startswith(f"{out}/")} or {f"{out}/made"}
        for path in map(Path, [out] if Path(out).suffix else sorted(inside)):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"{stage} {digest.hexdigest()}")
    if stage == "evaluate":
        r, t = resolution["decimate"], resolution["texture"]
        cost = {
            "triangles": r * r,
            "mesh_bytes": r,
            "texture_bytes": 100 * t,
            "gpu_bytes": 1000,
            "video_bits_per_second": t,
        }
        cost |= {"train_seconds": 1.0, "export_seconds": 2.0}
        metrics = {"subject": subject, "asset": {"psnr_subject": 10 + r / 10 + t / 100, "lpips": None}, "cost": cost}
        Path("data", subject, "metrics.json").write_text(json.dumps(metrics))


main()
