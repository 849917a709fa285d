"""Registries: another entry is a file, known by its name before anything is imported."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest
from av.codec import Codec
from pydantic import ValidationError
from typer.testing import CliRunner

from facefolds_core.asset import codecs
from facefolds_core.asset.codecs import CODECS
from facefolds_core.cli import app
from facefolds_core.params import Subject, compress, subject
from facefolds_core.registry import EXPORTERS, SOURCES, Registry
from tests.assets import make_asset
from tests.processes import printed


def test_every_source_reads() -> None:
    assert {"actor", "multiface", "transforms"} <= set(SOURCES.names) == set(get_args(subject.SourceName))
    assert all(callable(SOURCES[name].read) for name in SOURCES.names)
    assert [name for name in SOURCES.names if Subject(source=name, path="x").is_generated] == ["actor"]
    assert [name for name in SOURCES.names if not hasattr(SOURCES[name], "recognise")] == ["actor"]


def test_a_source_that_is_none_is_refused_with_the_names() -> None:
    with pytest.raises(KeyError):
        SOURCES["_actor"]
    with pytest.raises(ValidationError, match=r"'actor', .*'multiface'.* 'transforms'"):
        Subject(source="banana", path="x")


def test_every_codec_is_what_its_file_says() -> None:
    assert {"av1", "h264", "vp9"} <= set(CODECS)
    for name, codec in CODECS.items():
        assert codec.name == name
        assert Codec(codec.encoder, "w").is_encoder and Codec(codec.decoder, "r").is_decoder
    assert get_args(compress.CodecName) == get_args(codecs.CodecName) == tuple(CODECS)


@pytest.mark.parametrize("name", EXPORTERS.names)
def test_every_exporter_writes_and_says_what(name: str, tmp_path: Path) -> None:
    make_asset(tmp_path / "asset", layers=2, frames=1, resolution=32)
    done = CliRunner().invoke(app, ["export", name, str(tmp_path / "asset"), str(tmp_path / "out")])
    assert done.exit_code == 0 and done.stdout.startswith(f"export: {tmp_path / 'out'}: 2 layers")
    assert (tmp_path / "out").exists() and (EXPORTERS[name].__doc__ or "").strip()


def test_another_entry_is_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("__init__", "_shared", "one", "two"):
        (tmp_path / "many" / f"{name}.py").parent.mkdir(exist_ok=True)
        (tmp_path / "many" / f"{name}.py").write_text("VALUE = 3\n")
    monkeypatch.setattr("facefolds_core.registry._ROOT", tmp_path)
    assert Registry("facefolds_core.many").names == ("one", "two")


def test_parameters_know_the_names_without_the_modules() -> None:
    imported = printed("import sys, facefolds_core.params; print(*sys.modules)").split()
    assert "facefolds_core.params" in imported
    assert not [name for name in imported if name.startswith(("facefolds_core.captures", "facefolds_core.asset"))]
