"""Make .dvc/plots_page.html, the page that `dvc plots` fills, with the Vega library in it: no network is needed.

python -m bench.plots_page FOLDER/node_modules

where FOLDER has what `npm install vega@5.33.1 vega-lite@5.23.0 vega-embed@6.29.0` leaves there. The page is part of the
repository: this is only run to take newer versions. DVC's own page loads the library from a server.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from facefolds_core.errors import UserError, report_user_errors
from facefolds_core.files import read_json, write_text

LIBRARIES = ("vega", "vega-lite", "vega-embed")
BUNDLED = (
    "vega*", "d3-*", "topojson-client", "delaunator", "robust-predicates", "internmap", "semver", "fast-json-patch",
    "json-stringify-pretty-compact", "tslib",
)  # fmt: skip
"""Packages whose code is in the three libraries."""
PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
{refresh_tag}
<title>facefolds: plots</title>
<!-- %s: their licences are in plots_licences.txt -->
%s
<style>
body { font-family: system-ui, sans-serif; margin: 1rem; }
body > div { overflow-x: auto; }
table { border-spacing: 15px; }
</style>
</head>
<body>
{plot_divs}
</body>
</html>
"""
PLACEHOLDERS = ("{scripts}", "{plot_divs}", "{refresh_tag}")
"""What DVC replaces; no library may hold one. The page has no {scripts}: those would be DVC's links to a server."""


def page(modules: Path) -> str:
    """The page's text.

    Raises:
        UserError: if a library is not there, or cannot stand within a page.
    """
    names, scripts = [], []
    for name in LIBRARIES:
        path = modules / name / "build" / f"{name}.min.js"
        version = read_json(modules / name / "package.json", remedy="npm install it there")["version"]
        lines = path.read_text(encoding="utf-8").splitlines()
        text = "\n".join(line for line in lines if not line.startswith("//# sourceMappingURL"))
        if "</script" in text.lower() or any(placeholder in text for placeholder in PLACEHOLDERS):
            raise UserError("this version cannot stand within a page", file=path, remedy="take another one")
        names.append(f"{name} {version}")
        scripts.append(f"<script>\n{text}\n</script>")
    return PAGE % (", ".join(names), "\n".join(scripts))


def licences(modules: Path) -> str:
    """The licences of all packages in the libraries, each text once."""
    texts: dict[str, list[str]] = {}
    for folder in sorted({path for pattern in BUNDLED for path in modules.glob(pattern)}):
        for path in sorted(folder.glob("LICENSE*")):
            texts.setdefault(path.read_text(encoding="utf-8").strip(), []).append(folder.name)
    return "\n\n".join(f"{'-' * 80}\n{', '.join(names)}\n{'-' * 80}\n{text}" for text, names in texts.items()) + "\n"


def main(
    modules: Annotated[Path, typer.Argument(help="The folder node_modules.")],
    target: Annotated[Path, typer.Option(help="The page.")] = Path(".dvc/plots_page.html"),
) -> None:
    """Put the Vega library into the page that `dvc plots` fills."""
    with report_user_errors("plots_page"):
        write_text(target, page(modules))
        write_text(target.with_name("plots_licences.txt"), licences(modules))


if __name__ == "__main__":
    typer.run(main)
