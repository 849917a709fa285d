"""A DVC project whose stages are one-liners: a subject's job takes as long as DVC does."""

from __future__ import annotations

from pathlib import Path

import yaml

STAGE = """\
import json, os, sys, time
from pathlib import Path

subject = os.environ["DVC_STAGE"].split("@")[1]
seconds = json.loads(Path(f"data/.config/{subject}.json").read_text())
out = Path("data", subject)
out.mkdir(parents=True, exist_ok=True)
print("at work")
if subject == "bad":
    sys.exit("evaluate: error: this one is bad")
begun = os.environ.get("BEGUN")  # a folder: says who runs, and how many times
if begun:
    Path(begun, f"{subject}-{os.getpid()}").write_text(str(os.getppid()))
    time.sleep(seconds)
made = {"subject": subject, "asset": {"psnr": 20.0 + len(subject)}, "cost": {"mesh_bytes": 10, "texture_bytes": 5}}
(out / "metrics.json").write_text(json.dumps(made))
"""

CONFIGURE = """\
import json, yaml
from pathlib import Path

Path("data/.config").mkdir(parents=True)
for name, subject in yaml.safe_load(Path("params.yaml").read_text())["subjects"].items():
    Path(f"data/.config/{name}.json").write_text(json.dumps(subject["train"]["seed"]))
"""

DVC_YAML = """\
stages:
  configure:
    cmd: python stages/configure.py
    deps: [stages]
    params:
      - params.yaml:
    outs: [data/.config]
  evaluate:
    foreach: ${subjects}
    do:
      cmd: python stages/evaluate.py
      deps: ["data/.config/${key}.json", "${item.path}"]
      outs: ["data/${key}/metrics.json"]
"""


def make_project(root: Path, *subjects: str, seconds: int = 0) -> Path:
    """Write it to `root`.

    Args:
        seconds: that a subject's stage takes where the environment names a folder BEGUN.
    """
    (root / ".dvc").mkdir(parents=True)
    (root / ".dvc" / "config").write_text("[core]\n    analytics = false\n    no_scm = true\n")
    (root / "stages").mkdir()
    (root / "stages" / "evaluate.py").write_text(STAGE)
    (root / "stages" / "configure.py").write_text(CONFIGURE)
    (root / "dvc.yaml").write_text(DVC_YAML)
    captures = root.parent / f"{root.name}-captures"
    captures.mkdir()
    entry = {"source": "transforms", "path": f"../{captures.name}", "train": {"preset": "fast", "seed": seconds}}
    (captures / "one").write_text("1")
    sections = ("capture", "normalize", "train", "sample", "reconstruct", "decimate", "texture", "bake", "compress")
    values = {"subjects": {name: {**entry} for name in subjects}, **{name: {} for name in (*sections, "evaluate")}}
    (root / "params.yaml").write_text(yaml.dump(values, default_flow_style=False, sort_keys=False))
    return root
