"""The site of the documents: links of moved pages, the player on the first page, the library's page."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

import facefolds_core
from docs.tools import site
from docs.tools.site import ACTOR, FRAME, HERO, HERO_COMMIT, first_page, has_photos, hero_age, playing_page, relinked
from facefolds_core.errors import UserError
from tests.assets import make_asset
from tests.viewer.fixtures import rich_asset


@pytest.mark.parametrize(
    ("source", "link", "moved"),
    [
        ("README.md", "docs/guide/viewer.md", "guide/viewer.md"),
        ("README.md", "docs/README.md", "documents.md"),
        ("docs/guide/actor.md", "../reference/params.md#capture", "../reference/params.md#capture"),
        ("docs/guide/actor.md", "../../bench/RESULTS.md#x", "../research/results.md#x"),
        ("bench/RESULTS.md", "../README.md#results", "../index.md#results"),
        ("docs/research/README.md", "../README.md", "../documents.md"),
        ("docs/guide/actor.md", "#frames-and-units", "#frames-and-units"),
        ("README.md", "https://example.org/a.md", "https://example.org/a.md"),
    ],
)
def test_links_lead_to_where_a_page_moved(source: str, link: str, moved: str, project_root: Path) -> None:
    assert relinked(f"[x]({link})", source, project_root) == (f"[x]({moved})", set())


def test_other_files_go_along_code_is_left_alone_and_a_link_to_nothing_is_refused(project_root: Path) -> None:
    text, wanted = relinked("[keys](params.yaml)", "README.md", project_root)
    assert (text, wanted) == ("[keys](files/params.yaml)", {"params.yaml"})
    code = "```md\n[x](nowhere.md)\n```"
    assert relinked(code, "README.md", project_root)[0] == code
    with pytest.raises(UserError, match="leads to nothing"):
        relinked("[x](gone.md)", "README.md", project_root)


def test_the_player_takes_the_place_of_the_readmes_picture(project_root: Path) -> None:
    text = (project_root / "README.md").read_text(encoding="utf-8")
    shown = first_page(text, player=True)
    assert FRAME in shown and "face.webp" not in shown
    assert len(shown.splitlines()) == len(text.splitlines())
    assert first_page(text, player=False) == text


def test_the_first_page_plays_the_hero_or_else_the_actor(tmp_path: Path) -> None:
    player = tmp_path / "player"
    assert playing_page(tmp_path, (player,)) is None
    make_asset(tmp_path / ACTOR, frames=1)
    assert playing_page(tmp_path, (player,)) is None  # nothing to play it with
    player.mkdir()
    for name in ("index.html", "single.js"):
        (player / name).write_text("// the player")
    page = playing_page(tmp_path, (player,))
    assert page is not None and 'data-file="manifest.json"' in page
    (tmp_path / HERO).parent.mkdir(parents=True)
    (tmp_path / HERO).write_text("the hero")
    assert playing_page(tmp_path, (player,)) == "the hero"


def test_the_hero_says_its_age(tmp_path: Path) -> None:
    def git(*words: str) -> str:
        who = ("-c", "user.name=A", "-c", "user.email=a@example.org")
        command = ["git", "-C", str(tmp_path), *who, *words]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    assert hero_age(tmp_path) == ""
    git("init", "-q")
    git("commit", "-q", "--allow-empty", "-m", "made")
    (tmp_path / HERO_COMMIT).parent.mkdir(parents=True)
    made = git("rev-parse", "--short=12", "HEAD")
    (tmp_path / HERO_COMMIT).write_text(f"{made}+")
    for name in ("params.yaml", "README.md"):  # the second is none of its code
        (tmp_path / name).write_text("changed")
        git("add", name)
        git("commit", "-q", "-m", name)
    assert hero_age(tmp_path) == f"Made by {made}+, 1 changes of its code ago."
    (tmp_path / HERO_COMMIT).write_text("0123456789ab")
    assert hero_age(tmp_path) == "Made by 0123456789ab, which is not in this history."
    assert f"{FRAME}<p><small>old</small></p>" in first_page("![x](y)", True, "old")


def test_a_hero_with_photos_is_held_against_one(tmp_path: Path) -> None:
    assert not has_photos(tmp_path)
    make_asset((tmp_path / HERO).parent / "asset", frames=1)
    (tmp_path / HERO).write_text("the hero")
    assert not has_photos(tmp_path)
    shutil.rmtree((tmp_path / HERO).parent / "asset")
    rich_asset((tmp_path / HERO).parent / "asset")
    assert has_photos(tmp_path)
    assert "hero.html#photo=0" in first_page("![x](y)", True, photos=True)
    assert "hero.html#photo=0" not in first_page("![x](y)", True)
    assert "hero_frames.jpg" in first_page("![x](y)", True, sheet=True)
    assert "hero_frames.jpg" not in first_page("![x](y)", True)


def test_the_librarys_page_has_every_name() -> None:
    page = site.api_page()
    assert all(f"heading: {name}\n" in page for name in facefolds_core.__all__ if not name.startswith("__"))
