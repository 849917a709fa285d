"""The documents as a site (`make docs`): what MkDocs cannot do by itself, as its hooks. mkdocs.yml names this file.

The first page is README.md, with the player in place of its moving picture where there is something to play: what
`make hero` has made (with its age), or the actor's asset of `make repro` where the player is built. Pages that lie
outside of docs/ join it; links between all of them lead to where they then are. The page of the library is made from
the names that `facefolds_core` offers and their docstrings.
"""

from __future__ import annotations

import posixpath
import re
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

import facefolds_core
from facefolds_core.asset import read_asset
from facefolds_core.errors import UserError
from facefolds_core.reporting.face import face
from facefolds_core.serving.player import PLACES

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
HERO = "dist/hero/hero.html"
HERO_COMMIT = "dist/hero/commit.txt"
HERO_FRAMES = "dist/hero/frames.jpg"
HERO_CODE = ("facefolds_core", "stages", "viewer/src", "params.yaml", "docs/tools/hero.yaml")
"""What it is made by: when any of it changes, the hero grows older."""
ACTOR = "data/actor/asset"
MOVED = {
    "README.md": "index.md",
    "docs/README.md": "documents.md",
    "bench/RESULTS.md": "research/results.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
}
"""File of the checkout -> page of the site; docs/X is X."""
API = "reference/api.md"
NOTES = "Research notes"
"""Their heading in mkdocs.yml."""
FRAME = (
    '<iframe src="hero.html#background=studio" title="The embedded actor, in the player" loading="lazy" '
    'allow="fullscreen"></iframe>'
)

BESIDE = '<a href="hero.html#photo=0">Beside a picture that no training saw: drag the border.</a>'


EVERY_FRAME = '<a href="hero_frames.jpg">Eyes and mouth, the photos above.</a>'


def place_of(path: str) -> str:
    """Where a file of the checkout is on the site; other files than documents lie under files/ as they are."""
    if path in MOVED:
        return MOVED[path]
    page = path.startswith("docs/") and not path.startswith("docs/tools/")
    return path.removeprefix("docs/") if page else f"files/{path}"


def relinked(text: str, source: str, root: Path = ROOT) -> tuple[str, set[str]]:
    """A document for its place on the site, and the files under files/ that it links to.

    Args:
        source: its path in the checkout.

    Raises:
        UserError: if a link leads to nothing.
    """
    wanted: set[str] = set()
    here = posixpath.dirname(place_of(source))

    def lead(link: re.Match[str]) -> str:
        target, _, anchor = link[1].partition("#")
        if not target or re.match(r"[a-z]+:", target):
            return link[0]
        path = posixpath.normpath(posixpath.join(posixpath.dirname(source), target))
        if not (root / path).exists():
            raise UserError("a link that leads to nothing", file=root / source, found=link[1])
        place = place_of(path)
        if place.startswith("files/"):
            wanted.add(path)
        return f"]({posixpath.relpath(place, here or '.')}{'#' * bool(anchor)}{anchor})"

    parts = re.split(r"(```.*?```)", text, flags=re.DOTALL)
    changed = [part if part.startswith("```") else re.sub(r"\]\(([^)\s]+)\)", lead, part) for part in parts]
    return "".join(changed), wanted


def playing_page(root: Path = ROOT, places: tuple[Path, ...] = PLACES) -> str | None:
    """HTML that plays the hero, or else the actor; None where neither is there, or no player is built.

    Args:
        places: where the built player may lie.
    """
    if (root / HERO).exists():
        return (root / HERO).read_text(encoding="utf-8")
    built = next((place for place in places if (place / "index.html").is_file()), None)
    found = face(read_asset(root / ACTOR), built) if (root / ACTOR).is_dir() else None
    return str(found["page"]) if found else None


def hero_age(root: Path = ROOT) -> str:
    """In words: what made the hero, and how often its code has changed since; empty where there is none."""
    if not (root / HERO_COMMIT).exists():
        return ""
    commit = (root / HERO_COMMIT).read_text(encoding="utf-8").strip()
    since = ["git", "-C", str(root), "rev-list", "--count", f"{commit.rstrip('+')}..HEAD", "--", *HERO_CODE]
    done = subprocess.run(since, capture_output=True, text=True, check=False)
    count = f"{done.stdout.strip()} changes of its code ago" if done.returncode == 0 else "which is not in this history"
    return f"Made by {commit}, {count}."


def has_photos(root: Path = ROOT) -> bool:
    """Whether the hero has photos to be held against."""
    folder = (root / HERO).parent / "asset"
    return (root / HERO).exists() and folder.is_dir() and bool(read_asset(folder).manifest.photos)


def first_page(text: str, player: bool, age: str = "", photos: bool = False, sheet: bool = False) -> str:
    """README.md with the player in place of its first picture, where there is one, and below it the hero's age, where
    it is seen beside a photo, with a border to drag, and the sheet of its eyes and mouth."""
    below = [*([BESIDE] if photos else []), *([EVERY_FRAME] if sheet else []), *([age] if age else [])]
    frame = f"{FRAME}<p><small>{' '.join(below)}</small></p>" if below else FRAME
    return re.sub(r"^!\[[^\]]*\]\([^)]*\)", lambda _: frame, text, count=1, flags=re.MULTILINE) if player else text


def with_steps(text: str) -> str:
    """A document with its flow charts of one row (Mermaid's `A[first] --> B[second]`) as lists: no script."""

    def steps(chart: re.Match[str]) -> str:
        items = "".join(f"<li>{label}</li>" for label in re.findall(r'\w+\["?([^]"]+)"?\]', chart[1]))
        return f'<ol class="steps">{items}</ol>'

    return re.sub(r"^```mermaid\nflowchart LR\n(.*?)^```$", steps, text, flags=re.DOTALL | re.MULTILINE)


def with_closed_tables(page: str) -> str:
    """HTML of the parameters' page: its tables marked as those of keys, and those for experts closed."""
    first, expert, rest = page.partition('<h2 id="expert-keys">')

    def closed(table: re.Match[str]) -> str:
        keys = re.findall(r"<td><code>(.*?)</code></td>\n<td>", table[0])
        names = ", ".join(f"<code>{key}</code>" for key in keys)
        count = f"{len(keys)} key{'s' * (len(keys) > 1)}"
        return f'<details class="keys"><summary>{count}: {names}</summary>{table[0]}</details>'

    shown = re.sub(r"<table>.*?</table>", lambda table: f'<div class="keys">{table[0]}</div>', first, flags=re.DOTALL)
    return shown + expert + re.sub(r"<table>.*?</table>", closed, rest, flags=re.DOTALL)


def api_page() -> str:
    """Every name of the library, with its signature and docstring."""
    lines = ["# The library, name by name", "", "From the docstrings; [in words](library.md).", ""]
    for name, (module, attribute) in sorted(facefolds_core._PLACES.items()):
        lines += [f"::: {module}.{attribute}", "    options:", f"      heading: {name}", f"      toc_label: {name}", ""]
    return "\n".join(lines)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Every research note under the heading that mkdocs.yml has for them."""
    notes = sorted((ROOT / "docs" / "research").glob("[a-z]*.md"))
    for entry in config.nav or []:
        if NOTES in entry:
            entry[NOTES] += [f"research/{path.name}" for path in notes]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """The pages from outside of docs/, those with changed links, and the files that they name."""
    from mkdocs.structure.files import File

    documents = {f"docs/{file.src_uri}" for file in files.documentation_pages()} | set(MOVED)
    wanted: set[str] = set()
    playing, sheet = playing_page(), ROOT / HERO_FRAMES
    for source in sorted(documents):
        text = (ROOT / source).read_text(encoding="utf-8")
        text, more = relinked(
            with_steps(first_page(text, playing is not None, hero_age(), has_photos(), sheet.exists()))
            if source == "README.md"
            else text,
            source,
        )
        wanted |= more
        place = place_of(source)
        if (old := files.get_file_from_path(source.removeprefix("docs/"))) is not None:
            files.remove(old)
        files.append(File.generated(config, place, content=text))
    files.append(File.generated(config, API, content=api_page()))
    for path in sorted(wanted):
        files.append(File.generated(config, place_of(path), abs_src_path=str(ROOT / path)))
    if playing is not None:
        files.append(File.generated(config, "hero.html", content=playing))
        if sheet.exists():
            files.append(File.generated(config, "hero_frames.jpg", abs_src_path=str(sheet)))
    return files


def on_page_content(html: str, page: Page, **_: object) -> str:
    """The parameters' page folded up."""
    return with_closed_tables(html) if page.file.src_uri == "reference/params.md" else html


def on_page_context(context: dict[str, Any], page: Page, **_: object) -> dict[str, Any]:
    """No link "edit this page": the generated ones have no place to be edited at."""
    page.edit_url = None
    return context
