"""JSON and YAML as our files may hold them: whatever else a text says is a `UserError`, never another exception.

Refused beside what the formats themselves refuse: a key given twice, whole numbers of more than 64 bits, nesting deeper
than `MAX_DEPTH`, and YAML whose aliases unfold to more than `MAX_NODES` values. NaN and infinity pass, as they do in
Python's `json`: who reads a number checks it.
"""

from __future__ import annotations

import json
import re
from functools import cache, partial
from pathlib import Path
from typing import Any, NoReturn

from facefolds_core.errors import UserError

MAX_DEPTH = 60
MAX_NODES = 200_000
MAX_INTEGER = 2**63 - 1
_64_BITS = "numbers of at most 64 bits"
_TOO_DEEP = f"at most {MAX_DEPTH} lists or objects inside one another"


def brief(value: object, length: int = 100) -> str:
    """`repr` for messages, cut to `length` characters."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of more digits than Python prints; a list that holds itself
        text = f"a value of type {type(value).__name__} that cannot be shown"
    return text if len(text) <= length else text[: length - 3] + "..."


def parse_json(text: str, file: str | Path, remedy: str) -> Any:
    """The value of a JSON text.

    Args:
        file, remedy: for the message.

    Raises:
        UserError: if it is not JSON, or one of the things that the module's head lists.
    """
    wrong = partial(UserError, file=file, remedy=remedy)

    def integer(digits: str) -> int:
        if len(digits) > 20 or abs(int(digits)) > MAX_INTEGER:
            raise wrong("a number too large", expected=_64_BITS, found=brief(digits))
        return int(digits)

    def no_key_twice(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        value = dict(pairs)
        if len(value) < len(pairs):
            names = [name for name, _ in pairs]
            twice = next(brief(name) for name in names if names.count(name) > 1)
            raise wrong("a key given twice", expected="each key once", found=twice)
        return value

    try:
        value = json.loads(text, parse_int=integer, object_pairs_hook=no_key_twice)
        if depth_of(value) > MAX_DEPTH:
            raise RecursionError
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise wrong("garbled JSON", place=place, expected="valid JSON", found=error.msg) from None
    except RecursionError:
        raise wrong("nested too deeply", expected=_TOO_DEEP) from None
    except MemoryError:
        raise wrong("too large for the memory", expected="a smaller file") from None
    return value


def depth_of(value: Any) -> int:
    """How many lists and objects stand inside one another at most; 0 for a bare value."""
    depth, inside = 0, [value]
    while inside := [entry for entry in inside if isinstance(entry, (dict, list))]:
        depth += 1
        inside = [e for entry in inside for e in (entry.values() if isinstance(entry, dict) else entry)]
    return depth


def parse_yaml(text: str, file: str | Path, remedy: str) -> Any:
    """The value of a YAML text: mappings, lists, texts, numbers, true, false, null, dates.

    Raises:
        UserError: if it is not YAML, or one of the things that the module's head lists; names the line where it can.
    """
    import yaml  # here: what reads an asset needs parse_json only, and PyYAML comes with an extra

    wrong = partial(UserError, file=file, remedy=remedy)
    try:
        loader = _yaml_loader()(text)
        node = loader.get_single_node()
        if node is None:
            return None
        _check_node(node, file, remedy)
        value = loader.construct_document(node)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = None if mark is None else f"line {mark.line + 1}, column {mark.column + 1}"
        found = getattr(error, "problem", None) or brief(str(error), 300)
        remedy = "mend this line"
        raise wrong("garbled YAML", place=place, expected="valid YAML", found=found, remedy=remedy) from None
    except RecursionError:
        raise wrong("nested too deeply", expected=_TOO_DEEP) from None
    except MemoryError:
        raise wrong("too large for the memory", expected="a smaller file") from None
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError) as error:
        # What PyYAML's own constructors raise for `!!int x`, `!!bool x`, `!!timestamp x`, 2024-13-45, ...
        expected = "a number, date or text as YAML writes them"
        raise wrong("a value that is not of its type", expected=expected, found=brief(str(error))) from None
    _check_numbers(value, file, remedy)
    return value


@cache
def _yaml_loader() -> Any:
    """PyYAML follows YAML 1.1, in which 1e-3 is a text; DVC reads and writes YAML 1.2, in which it is a number."""
    import yaml

    class Loader(yaml.SafeLoader):
        """Own tables of resolvers: those of SafeLoader stay as they are."""

    Loader.add_implicit_resolver(
        "tag:yaml.org,2002:float",
        re.compile(r"[-+]?(?:[0-9][0-9_]*\.?[0-9_]*|\.[0-9][0-9_]*)[eE][-+]?[0-9]+$"),
        list("-+.0123456789"),
    )
    return Loader


def _check_node(root: Any, file: str | Path, remedy: str) -> None:
    """Keys given twice, aliases of what they stand in, and aliases that unfold beyond measure."""
    import yaml

    sizes: dict[int, int] = {}
    open_nodes: set[int] = set()

    def refuse(node: Any, message: str, expected: str, found: str | None = None) -> NoReturn:
        mark = node.start_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}"
        raise UserError(message, file=file, place=place, expected=expected, found=found, remedy=remedy)

    def size(node: Any) -> int:
        """Values of `node` with all aliases unfolded."""
        if id(node) in open_nodes:
            refuse(node, "an alias of what it stands in", "no list or mapping that holds itself")
        if id(node) in sizes:
            return sizes[id(node)]
        if len(open_nodes) > MAX_DEPTH:
            refuse(node, "nested too deeply", _TOO_DEEP)
        open_nodes.add(id(node))
        count = 1
        if isinstance(node, yaml.MappingNode):
            keys = set()
            for key, value in node.value:
                count += size(key) + size(value)
                name = (key.tag, key.value) if isinstance(key, yaml.ScalarNode) else id(key)
                if name in keys:
                    refuse(key, "a key given twice", "each key once", brief(getattr(key, "value", None)))
                keys.add(name)
        elif isinstance(node, yaml.SequenceNode):
            count += sum(map(size, node.value))
        if count > MAX_NODES:
            refuse(node, "too many values", f"at most {MAX_NODES}, with all aliases unfolded", str(count))
        open_nodes.discard(id(node))
        sizes[id(node)] = count
        return count

    size(root)


def _check_numbers(value: Any, file: str | Path, remedy: str) -> None:
    inside = [value]
    while inside:
        entry = inside.pop()
        if isinstance(entry, dict):
            inside += [*entry, *entry.values()]
        elif isinstance(entry, (list, tuple, set)):
            inside += entry
        elif isinstance(entry, int) and abs(entry) > MAX_INTEGER:
            raise UserError("a number too large", file=file, expected=_64_BITS, found=brief(entry), remedy=remedy)
