"""dvc.yaml: every stage depends on all the project's code that it imports, and on nothing that it does not."""

from __future__ import annotations

from pathlib import Path

import grimp
import pytest
import yaml

STAGES = [
    "configure",
    "capture",
    "normalize",
    "train",
    "sample",
    "reconstruct",
    "decimate",
    "texture",
    "bake",
    "compress",
    "evaluate",
]


@pytest.fixture(scope="module")
def pipeline(project_root: Path) -> dict[str, dict[str, list[str]]]:
    stages = yaml.safe_load((project_root / "dvc.yaml").read_text())["stages"]
    return {name: stage["do"] for name, stage in stages.items()}


@pytest.fixture(scope="module")
def imports() -> grimp.ImportGraph:
    return grimp.build_graph("facefolds_core", "stages", cache_dir=None, exclude_type_checking_imports=True)


def imported_files(graph: grimp.ImportGraph, stage: str, root: Path) -> set[str]:
    """Non-empty files of the project that `stages.<stage>` imports, directly or not, itself included."""
    modules = {f"stages.{stage}"} | graph.find_upstream_modules(f"stages.{stage}")
    files = set()
    for module in modules:
        path = root / (module.replace(".", "/") + ".py")
        path = path if path.exists() else root / module.replace(".", "/") / "__init__.py"
        if path.read_text().strip():
            files.add(path.relative_to(root).as_posix())
    return files


def code_deps(stage: dict[str, list[str]]) -> set[str]:
    return {dep for dep in stage["deps"] if dep.startswith(("stages/", "facefolds_core/"))}


def test_the_stages_are_all_there(pipeline: dict[str, dict[str, list[str]]]) -> None:
    assert list(pipeline) == STAGES


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_depends_on_the_code_that_it_imports(
    stage: str, pipeline: dict[str, dict[str, list[str]]], imports: grimp.ImportGraph, project_root: Path
) -> None:
    deps = code_deps(pipeline[stage])
    files = imported_files(imports, stage, project_root)
    missing = sorted(f for f in files if f not in deps and not any(f.startswith(d + "/") for d in deps))
    unused = sorted(d for d in deps if d not in files and not any(f.startswith(d + "/") for f in files))
    assert (missing, unused) == ([], [])


def test_a_change_of_texture_resolution_reruns_three_stages(pipeline: dict[str, dict[str, list[str]]]) -> None:
    changed = {"data/${key}/config/texture.json"}
    rerun: list[str] = []
    for name, stage in pipeline.items():
        if any(
            dep == c or c.startswith(dep + "/") or dep.startswith(c + "/") for dep in stage["deps"] for c in changed
        ):
            rerun.append(name)
            changed |= set(stage["outs"]) | set(stage.get("metrics", []))
    assert rerun == ["texture", "bake", "compress", "evaluate"]
