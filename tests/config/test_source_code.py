"""Digests of code: what a stage does counts, words do not."""

from __future__ import annotations

from pathlib import Path

import grimp
import pytest

from facefolds_core.config.source_code import digest_of_file, digests_of_stages
from facefolds_core.errors import UserError
from facefolds_core.params import STAGE_SECTIONS
from facefolds_core.registry import MODELS, SOURCES

CODE = '''"""A module."""
SIZE = 3
"""A number."""


def double(x: int) -> int:
    """Twice."""
    return 2 * x
'''


def digest(folder: Path, code: str) -> str:
    (folder / "code.py").write_text(code)
    return digest_of_file(folder / "code.py")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("A module.", "Another text."),
        ('"""A number."""', ""),
        ('    """Twice."""\n', "    # Twice.\n"),
        ("2 * x", "(2 * x)  # twice"),
        ("SIZE = 3\n", "\n\nSIZE =   3\n"),
    ],
)
def test_words_do_not_count(old: str, new: str, tmp_path: Path) -> None:
    assert digest(tmp_path, CODE.replace(old, new, 1)) == digest(tmp_path, CODE) and old in CODE


@pytest.mark.parametrize(("old", "new"), [("SIZE = 3", "SIZE = 4"), ("2 * x", "x * 2"), ("x: int", "x: float")])
def test_code_does(old: str, new: str, tmp_path: Path) -> None:
    assert digest(tmp_path, CODE.replace(old, new)) != digest(tmp_path, CODE)


def test_texts_that_are_values_do(tmp_path: Path) -> None:
    assert digest(tmp_path, "f('a')") != digest(tmp_path, "f('b')")


@pytest.fixture(scope="module")
def found(project_root: Path) -> dict[str, dict[str, str]]:
    return digests_of_stages(project_root, STAGE_SECTIONS)


def test_every_stage_has_itself_and_what_it_imports(found: dict[str, dict[str, str]]) -> None:
    assert list(found) == list(STAGE_SECTIONS)
    for stage, modules in found.items():
        assert {f"stages.{stage}", "stages.common", "facefolds_core.params"} <= set(modules)
    assert "facefolds_core.training.explicit.fit" in found["train"]
    assert "facefolds_core.reporting.build" not in {module for modules in found.values() for module in modules}


def test_who_imports_a_registry_has_all_its_entries(found: dict[str, dict[str, str]]) -> None:
    assert {f"{SOURCES.package}.{name}" for name in SOURCES.names} <= set(found["normalize"])
    for stage in ("capture", "train"):  # an edit of a reader films nobody and trains nobody again
        assert not {name for name in found[stage] if name.startswith(SOURCES.package)}


def test_every_import_of_every_module_is_there(found: dict[str, dict[str, str]]) -> None:
    graph = grimp.build_graph("facefolds_core", "stages", cache_dir=None, exclude_type_checking_imports=True)
    for modules in found.values():
        for module in modules:
            if module not in {f"{MODELS.package}.{name}" for name in MODELS.names}:
                assert graph.find_modules_directly_imported_by(module) <= set(modules)


def test_a_model_counts_where_its_functions_are_called(found: dict[str, dict[str, str]]) -> None:
    kept = "facefolds_core.training.trainers.explicit"
    built, fitted = "facefolds_core.model.storage", "training.explicit.loop"
    for stage, modules in found.items():
        assert {kept, "facefolds_core.params.explicit"} <= set(modules)  # its keys
        assert (built in modules) == (stage in ("train", "sample", "evaluate")), stage
        assert (f"facefolds_core.{fitted}" in modules) == (stage == "train"), stage


def test_a_file_that_is_not_python_is_named(tmp_path: Path) -> None:
    (tmp_path / "code.py").write_text("def (")
    with pytest.raises(UserError, match=r"code\.py") as caught:
        digest_of_file(tmp_path / "code.py")
    assert caught.value.place == "line 1"
