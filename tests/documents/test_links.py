"""Markdown: every link within the repository leads to a file and a heading that are there; so do paths in the code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

PLACES = ["*.md", "bench/*.md", "data/*.md", "docs/**/*.md", "engines/**/*.md", "viewer/*.md"]
CODE = ["*.yaml", "Makefile", "*.toml", "bench/*.py", "stages/*.py", "facefolds_core/**/*.py", "engines/**/*.py"]
CODE += ["docs/**/*.py"]
CODE += ["tests/**/*.py", "tests/**/*.js", "viewer/src/**/*.js", "*.md", "bench/*.md", "docs/**/*.md"]


def found(root: Path, patterns: list[str]) -> list[Path]:
    """Files that match, and none of what npm installed or DVC made."""
    every = {file for pattern in patterns for file in root.glob(pattern)}
    return sorted(file for file in every if "node_modules" not in file.parts)


def slug(heading: str) -> str:
    """A heading's anchor, as GitHub makes it: small letters, digits, `-` and `_`."""
    shown = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    return re.sub(r"[^\w\- ]", "", shown.lower()).replace(" ", "-")


def broken_links(document: Path) -> list[str]:
    """Targets of links, relative ones, that are not there."""
    text = without_code(document.read_text(encoding="utf-8"))
    return [target for target in re.findall(r"\]\(([^)\s]+)\)", text) if not leads_somewhere(document, target)]


def without_code(text: str) -> str:
    return re.sub(r"```.*?```", "", text, flags=re.DOTALL)


def leads_somewhere(document: Path, target: str) -> bool:
    if re.match(r"[a-z]+:", target):
        return True
    path, _, anchor = target.partition("#")
    file = document.parent / path if path else document
    if not file.exists() or not anchor:
        return file.exists()
    headings = re.findall(r"^#+ +(.*)$", without_code(file.read_text(encoding="utf-8")), re.MULTILINE)
    return anchor in {slug(heading) for heading in headings}


def test_links_of_the_documents(project_root: Path) -> None:
    documents = found(project_root, PLACES)
    assert len(documents) > 20
    broken = {str(document.relative_to(project_root)): broken_links(document) for document in documents}
    assert not {name: targets for name, targets in broken.items() if targets}


@pytest.mark.parametrize("target", ["gone.md", "there.md#gone", "#gone", "gone/"])
def test_a_broken_link_is_found(tmp_path: Path, target: str) -> None:
    (tmp_path / "there.md").write_text("# A heading, `code` and more\n")
    page = tmp_path / "page.md"
    page.write_text(f"# Page\n[x]({target}) [y](there.md#a-heading-code-and-more) [z](#page) ![w](there.md)\n")
    assert broken_links(page) == [target]


def test_documents_that_are_named(project_root: Path) -> None:
    """Code and documents name documents and their pictures by their path from the top."""
    missing: dict[str, list[str]] = {}
    for file in found(project_root, CODE):
        names = re.findall(r"(?<![\w/.])(docs/[\w./-]+\.(?:md|jpg|png|svg|webp))\b", file.read_text(encoding="utf-8"))
        gone = [name for name in names if not (project_root / name).exists()]
        if gone and file != Path(__file__):
            missing[str(file.relative_to(project_root))] = gone
    assert not missing
