"""`python -m facefolds_core`: the command `facefolds`, where it is not on the PATH."""

from facefolds_core.cli import app

app(prog_name="facefolds")
