"""Hashes of everything that the pipeline makes: equal before and after a change that should change nothing.

    python -m tests.golden --out before.json            # on the old code
    python -m tests.golden --against before.json        # on the new one: exit 1, and a line a file, where they differ

It runs every stage of a tiny capture (explicit model and perceptrons) and, unless `--tiny`, of the actor as params.yaml
has it. Hashes depend on the processor and the libraries: compare them on one machine only, they are not kept.
Seconds and rates are left out of the JSON files.
"""

from __future__ import annotations

import hashlib
import json
import sys
import tempfile
from pathlib import Path
from typing import Annotated, Any

import typer
import yaml

from bench.run import Project, own_params
from facefolds_core.errors import report_user_errors
from facefolds_core.params import STAGE_SECTIONS

UNTIMED = ("timings", "training", "config", "checkpoints", "locks")
"""Folders that hold times, processes, or what was asked for."""

TINY = """\
subjects:
  tiny:
    source: actor
    path: facefolds_core/captures/actor
    holdout: {every: 4}
    train: {preset: fast, layers: 3, iterations: 200}
  tiny_quick:
    source: actor
    path: facefolds_core/captures/actor
    holdout: {every: 4}
    train: {preset: quick, iterations: 60, rays: 512, layers: 3, texture_width: 32, manifold_width: 32}
capture: {cameras: 8, frames: 2, height: 48, width: 32, mattes: true}
normalize: {}
subject: {iterations: 300}
train: {}
sample: {resolution: 64}
reconstruct: {}
decimate: {resolution: 12}
texture: {resolution: 32}
bake: {}
compress: {}
evaluate: {}
"""


def without_times(value: Any) -> Any:
    """A JSON value without seconds and rates."""
    if isinstance(value, dict):
        return {k: without_times(v) for k, v in value.items() if "second" not in k and "fingerprint" not in k}
    return [without_times(v) for v in value] if isinstance(value, list) else value


def without_fingerprint(content: bytes) -> bytes:
    """A safetensors file whose description says nothing of the configuration: numbers, names and shapes only."""
    size = int.from_bytes(content[:8], "little")
    header = json.loads(content[8 : 8 + size])
    about = header.get("__metadata__", {})
    header["__metadata__"] = without_times(json.loads(about["spec"])) if "spec" in about else about
    return json.dumps(header, sort_keys=True).encode() + content[8 + size :]


def digests(folder: Path) -> dict[str, str]:
    """File of one subject's folder -> SHA-256 of what it says."""
    found = {}
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        name = path.relative_to(folder)
        if name.parts[0] in UNTIMED or name.name == "training.json":
            continue
        content = path.read_bytes()
        if path.suffix == ".json":
            content = json.dumps(without_times(json.loads(content)), sort_keys=True).encode()
        if path.suffix == ".safetensors":
            content = without_fingerprint(content)
        found[name.as_posix()] = hashlib.sha256(content).hexdigest()
    return found


def differences(before: dict[str, dict[str, str]], after: dict[str, dict[str, str]]) -> list[str]:
    """A line for each file that differs, or is on one side only."""
    return [
        f"{subject}/{name}: {old.get(name, 'missing')[:12]} before, {new.get(name, 'missing')[:12]} now"
        for subject, new in after.items()
        for old in [before.get(subject, {})]
        for name in sorted({*old, *new})
        if old.get(name) != new.get(name)
    ]


def main(
    out: Annotated[Path | None, typer.Option(help="Write the hashes to this JSON file.")] = None,
    against: Annotated[Path | None, typer.Option(help="Compare with the hashes in this file.")] = None,
    tiny: Annotated[bool, typer.Option(help="Leave out the actor at its full size.")] = False,
) -> None:
    """Hash what the pipeline makes; compare with an earlier run."""
    found = {}
    with tempfile.TemporaryDirectory() as temporary, report_user_errors("golden"):
        wanted = {"tiny": yaml.safe_load(TINY), "tiny_quick": yaml.safe_load(TINY)}
        for subject, params in (wanted if tiny else {**wanted, "actor": own_params("actor", {})}).items():
            project = Project(Path(temporary), subject)
            project.write(params)
            for stage in ("configure", *STAGE_SECTIONS):
                project.run(stage)
                typer.echo(f"{stage} of {subject}", err=True)
            found[subject] = digests(project.folders.root)
    if out is not None:
        out.write_text(json.dumps(found, indent=1))
    if against is not None:
        lines = differences(json.loads(against.read_text()), found)
        if lines:
            sys.exit("\n".join(lines))
        typer.echo(f"equal: {sum(map(len, found.values()))} files of {', '.join(found)}")


if __name__ == "__main__":
    typer.run(main)
