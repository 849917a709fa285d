"""The command `facefolds`: one name for everything that is not a stage of the pipeline.

A command's module is imported when the command is used, so that `facefolds --help` is quick and playing an asset needs
nothing of what trains one.
"""

from __future__ import annotations

import importlib
import sys
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from facefolds_core import __version__

COMMANDS = {
    "view": "Play an asset in a browser.",
    "render": "Stills and films of an asset, without a screen.",
    "validate": "Check an asset whole, and say what is wrong with it.",
    "export": "Write an asset as another program can read it.",
    "export-html": "One HTML file that plays an asset by itself.",
    "scores": "Scores, size and place of the assets that were made.",
    "report": "A page that tells all about a subject.",
    "run": "Many subjects, or a grid of parameters, at once: here or on a cluster.",
    "doctor": "Is all here that the pipeline needs? Mends what a killed DVC leaves. What is in a folder?",
}
"""Name -> what it does. `NAME` is the function `command` of `facefolds_core/cli/NAME.py`, with _ for -."""


EXTRAS = {
    "scores": "train",
    "report": "report",
    "run": "cluster",
}
"""Commands that need more than the base -> the extra that brings it."""


class LazyCommands(TyperGroup):
    """A group whose commands are imported when they are asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in COMMANDS:
            return None
        module = _module(cmd_name)
        single = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
        single.command(name=cmd_name)(module.command)
        return typer.main.get_command(single)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


def _module(name: str) -> Any:
    """The module of a command. What pip has not installed is named, with the extra that brings it."""
    try:
        return importlib.import_module(f"facefolds_core.cli.{name.replace('-', '_')}")
    except ModuleNotFoundError as error:
        if name not in EXTRAS or (error.name or "").startswith("facefolds_core"):
            raise
        remedy = f"pip install 'facefolds[{EXTRAS[name]}]'"
        sys.exit(f"facefolds {name}: error: it needs the package {error.name}, which is not installed: {remedy}")


app = typer.Typer(
    cls=LazyCommands,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"facefolds {__version__}")
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and end.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Multi-view face video to nested textured meshes with an RGBA texture video.

    The pipeline itself is run by DVC: `dvc repro evaluate@SUBJECT` in the project's folder.
    """
