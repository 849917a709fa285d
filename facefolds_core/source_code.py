"""What a stage's code does, as digests: one for each module that it imports.

DVC reruns a stage when the file of its digests changes (dvc.yaml). They are of the syntax tree without docstrings, so
that words, comments and layout rerun nothing.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterable
from pathlib import Path

import grimp
import grimp.exceptions

from facefolds_core.errors import UserError
from facefolds_core.registry import REGISTRIES

PACKAGES = ("facefolds_core", "stages")


def digests_of_stages(root: Path, stages: Iterable[str]) -> dict[str, dict[str, str]]:
    """Stage -> module that `stages.<stage>` imports, directly or not, itself included -> digest of what it does.

    Imports for type checking only are left out; who imports a registry imports all its entries.

    Args:
        root: folder of the packages; the one that they are imported from.

    Raises:
        UserError: if a file is not Python.
    """
    try:
        graph = grimp.build_graph(*PACKAGES, cache_dir=None, exclude_type_checking_imports=True)
    except grimp.exceptions.SourceSyntaxError as error:
        raise UserError("not Python", file=error.filename, place=f"line {error.lineno}", remedy="mend it") from None
    for registry in REGISTRIES:  # imports that no statement names
        for name in registry.names:
            graph.add_import(importer=registry.package, imported=f"{registry.package}.{name}")
    known: dict[str, str] = {}
    found: dict[str, dict[str, str]] = {}
    for stage in stages:
        modules = sorted({f"stages.{stage}"} | graph.find_upstream_modules(f"stages.{stage}"))
        for module in modules:
            if module not in known:
                known[module] = digest_of_file(_file_of(root, module))
        found[stage] = {module: known[module] for module in modules}
    return found


def digest_of_file(path: Path) -> str:
    """Digest of what a Python file does: equal for files that differ in docstrings, comments and layout only."""
    tree = _tree(path)
    for node in ast.walk(tree):
        for name in ("body", "orelse", "finalbody"):
            lines = getattr(node, name, None)
            if isinstance(lines, list):
                setattr(node, name, [line for line in lines if not _is_text(line)])
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()[:16]


def _is_text(line: ast.AST) -> bool:
    """A docstring, of an attribute, too: a text that stands alone as a statement does nothing."""
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant) and isinstance(line.value.value, str)


def _tree(path: Path) -> ast.Module:
    try:
        return ast.parse(path.read_bytes())
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        raise UserError(
            "not Python", file=path, place=None if line is None else f"line {line}", found=str(error), remedy="mend it"
        ) from None


def _file_of(root: Path, module: str) -> Path:
    path = root / Path(*module.split("."))
    return path.with_suffix(".py") if path.with_suffix(".py").exists() else path / "__init__.py"
