"""What README, guide and reference tell one to type is there: commands, benchmarks, targets, names, keys."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

import facefolds_core
from facefolds_core.cli import COMMANDS

PAGES = ["README.md", "bench/RESULTS.md", "docs/*.md", "docs/guide/*.md", "docs/reference/*.md"]
MANIFEST_KEYS = {f"texture.{name}" for name in ("videos", "width", "height", "colour_rect", "alpha_rect")}
"""Of the asset's manifest: `texture` is a section of params.yaml, too."""


def documented_keys(root: Path) -> set[str]:
    """Sections, and keys with their section's path, of docs/reference/params.md, which is made from the code."""
    keys, section = set(), ""
    for line in (root / "docs/reference/params.md").read_text(encoding="utf-8").splitlines():
        if heading := re.match(r"#+ `([\w.]+)`", line):
            section = heading.group(1)
            keys.add(section)
        elif key := re.match(r"\|`([\w.]+)`\|", line):
            name = key.group(1)
            keys.add(name if "." in name else f"{section}.{name}")
    return keys


def unknown(text: str, root: Path) -> list[str]:
    """What a page names and there is not."""
    makefile = (root / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([\w-]+):", makefile, re.MULTILINE))
    keys = documented_keys(root)
    sections = {key.split(".")[0] for key in keys}
    said = [f"facefolds {name}" for name in re.findall(r"\bfacefolds ([a-z][a-z-]*)", code_of(text))]
    said = [name for name in said if name.split()[1] not in COMMANDS]
    said += [f"make {name}" for name in re.findall(r"(?:^|`)make ([a-z-]+)", text, re.MULTILINE) if name not in targets]
    modules = re.findall(r"python -m ((?:bench|docs|stages|tests|facefolds_core)[a-z_.]*)\b", text)
    said += [f"python -m {name}" for name in modules if importlib.util.find_spec(name) is None]
    used = re.findall(r"(?<!com\.)\bfacefolds\.(\w+)", text)
    said += [f"facefolds.{name}" for name in used if name not in facefolds_core.__all__]
    dotted = [
        key for key in re.findall(r"`([a-z_]+(?:\.[a-z_]+)+)(?:: [^`]*)?`", text) if key.split(".")[0] in sections
    ]
    return said + [key for key in dotted if key not in keys | MANIFEST_KEYS and not is_file(key)]


def code_of(text: str) -> str:
    """Blocks of the shell and code within lines, without the blocks' remarks."""
    blocks = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    inline = re.findall(r"`([^`\n]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL))
    return "\n".join(
        [re.sub(r"#.*", "", block) for block in blocks] + [line for line in inline if line[:10] == "facefolds "]
    )


def is_file(name: str) -> bool:
    return name.rsplit(".", 1)[-1] in {"json", "npz", "arrow", "py", "md", "png", "yaml"}


def test_what_the_pages_name_is_there(project_root: Path) -> None:
    pages = sorted({page for pattern in PAGES for page in project_root.glob(pattern)})
    assert len(pages) > 15
    missing = {page.name: unknown(page.read_text(encoding="utf-8"), project_root) for page in pages}
    assert not {page: names for page, names in missing.items() if names}


@pytest.mark.parametrize(
    "said",
    ["facefolds play", "make hay", "python -m bench.stress", "facefolds.splats", "compress.video.quality"],
)
def test_what_is_not_there_is_found(said: str, project_root: Path) -> None:
    text = f"`{said}` beside `facefolds view`, `make repro`, `python -m bench.hazards` and `compress.video.crf: 18`"
    assert unknown(text, project_root) == [said]
