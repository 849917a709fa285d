"""The benchmark of a GPU says where there is none."""

from __future__ import annotations

from pathlib import Path

import pytest
import typer

pytest.importorskip("numba_cuda", reason="the extra `cuda` is not installed")

from bench import gpu as bench_gpu
from facefolds_core.kernels import gpu


def test_without_a_gpu_it_ends_with_a_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(gpu, "available", lambda: False)
    with pytest.raises((SystemExit, typer.Exit)):
        bench_gpu.main(tmp_path / "takes", None, False)
    assert "no CUDA device" in capsys.readouterr().err
    assert not (tmp_path / "takes").exists()


def test_takes_are_the_actor_multifaces_size_and_mugsy(tmp_path: Path) -> None:
    takes = bench_gpu.projects(tmp_path, tmp_path / "capture")
    assert list(takes) == ["actor", "Multiface's size", "mugsy"]
    assert takes["Multiface's size"][1]["capture"]["height"] == 768
    assert list(takes["mugsy"][1]["subjects"]) == ["mugsy"]
    assert len({project.root for project, _ in takes.values()}) == 3
