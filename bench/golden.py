"""Where `python -m tests.golden` was: the same command, for branches that still call it here."""

import typer

from tests.golden import main

if __name__ == "__main__":
    typer.run(main)
