"""The files for Kubernetes: YAML, of one piece, with options that Dask knows. No cluster has seen them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml


@pytest.fixture(scope="module")
def parts(project_root: Path) -> dict[tuple[str, str], Any]:
    text = (project_root / "docs" / "guide" / "kubernetes" / "dask.yaml").read_text()
    return {(part["kind"], part["metadata"]["name"]): part for part in yaml.safe_load_all(text)}


def containers(parts: dict[tuple[str, str], Any]) -> dict[str, Any]:
    pods = [part["spec"]["template"]["spec"] for (kind, _), part in parts.items() if kind == "Deployment"]
    return {one["name"]: one for pod in pods for one in pod["containers"]}


def test_names_fit(parts: dict[tuple[str, str], Any]) -> None:
    for (kind, name), part in parts.items():
        if kind == "Deployment":
            labels = part["spec"]["template"]["metadata"]["labels"]
            assert part["spec"]["selector"]["matchLabels"] == labels == {"app": name}
    service = parts["Service", "facefolds-scheduler"]["spec"]
    assert ("Deployment", service["selector"]["app"]) in parts
    [address] = [word for word in containers(parts)["worker"]["args"] if word.startswith("tcp://")]
    assert re.fullmatch(r"tcp://facefolds-scheduler:(\d+)", address)
    assert int(address.rpartition(":")[2]) in [port["port"] for port in service["ports"]]
    pod = parts["Deployment", "facefolds-worker"]["spec"]["template"]["spec"]
    mounted = {mount["name"] for one in pod["containers"] for mount in one["volumeMounts"]}
    assert mounted == {volume["name"] for volume in pod["volumes"]}
    claims = {v["persistentVolumeClaim"]["claimName"] for v in pod["volumes"] if "persistentVolumeClaim" in v}
    assert all(("PersistentVolumeClaim", claim) in parts for claim in claims)


@pytest.mark.parametrize("name", ["scheduler", "worker"])
def test_dask_knows_the_options(parts: dict[tuple[str, str], Any], name: str) -> None:
    command = pytest.importorskip(f"distributed.cli.dask_{name}").main
    dask, kind, *arguments = containers(parts)[name]["args"]
    assert (dask, kind) == ("dask", name)
    command.make_context(kind, arguments)  # raises for an option or a value that it does not know
