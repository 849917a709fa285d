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
from facefolds_core.registry import MODELS, REGISTRIES

PACKAGES = ("facefolds_core", "stages")


def digests_of_stages(root: Path, stages: Iterable[str]) -> dict[str, dict[str, str]]:
    """Stage -> module that `stages.<stage>` imports, directly or not, itself included -> digest of what it does.

    Imports for type checking only are left out; who imports a registry imports all its entries. Every stage knows the
    models' keys; what else a model's module imports counts for stages that call the function which imports it.

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
    _join_models(graph, root)
    known: dict[str, str] = {}
    found: dict[str, dict[str, str]] = {}
    for stage in stages:
        modules = sorted({f"stages.{stage}"} | graph.find_upstream_modules(f"stages.{stage}"))
        for module in modules:
            if module not in known:
                known[module] = digest_of_file(_file_of(root, module))
        found[stage] = {module: known[module] for module in modules}
    return found


CALLED_BY = {
    "spec": "facefolds_core.model.storage",
    "build": "facefolds_core.model.storage",
    "train": "facefolds_core.training.trainers",
}
"""Function of a model's module (facefolds_core/training/trainers) -> module that calls it."""


def _join_models(graph: grimp.ImportGraph, root: Path) -> None:
    """Add what no statement names: params know all models, and their functions' imports are those of the callers."""
    for name in MODELS.names:
        model = f"{MODELS.package}.{name}"
        callers: dict[int, str] = {}
        for node in _tree(_file_of(root, model)).body:
            if isinstance(node, ast.FunctionDef) and node.name in CALLED_BY:
                callers |= dict.fromkeys(range(node.lineno, (node.end_lineno or 0) + 1), CALLED_BY[node.name])
        for imported in graph.find_modules_directly_imported_by(model):
            places = graph.get_import_details(importer=model, imported=imported)
            found = {callers.get(place["line_number"]) for place in places}
            if None not in found:
                graph.remove_import(importer=model, imported=imported)
            for caller in found - {None, imported}:
                graph.add_import(importer=str(caller), imported=imported)
        graph.add_import(importer="facefolds_core.params.train", imported=model)


def digest_of_packages(*names: str) -> str:
    """Of what the core's packages and modules `names` do: results of other code are not taken over."""
    here = Path(__file__).parents[1]
    alone = [here / f"{name}.py" for name in names if (here / f"{name}.py").is_file()]
    files = sorted([*alone, *(path for name in names for path in (here / name).rglob("*.py"))])
    return hashlib.sha256("".join(map(digest_of_file, files)).encode()).hexdigest()[:16]


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
