"""Change values of params.yaml in place: comments, order and style stay."""

from __future__ import annotations

from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap
from ruamel.yaml.error import YAMLError

from facefolds_core.config.params_file import load_params
from facefolds_core.errors import UserError
from facefolds_core.files.parsing import brief
from facefolds_core.files.writing import atomic_file


def set_for_subject(path: Path, subject: str, values: Mapping[str, Any]) -> None:
    """Set keys of stage sections for one subject, as overrides under `subjects`.

    Args:
        path: params.yaml.
        values: "section.key" -> value; "compress.video.crf" reaches deeper.

    Raises:
        UserError: if the file is not sound, has no such subject, or would not be sound afterwards: it is unchanged.
    """
    load_params(path).subject(subject)
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 10_000
    yaml.indent(mapping=2, sequence=4, offset=2)
    try:
        tree = yaml.load(path.read_text(encoding="utf-8"))
    except (YAMLError, ValueError, TypeError) as error:  # ruamel reads YAML 1.2, `load_params` 1.1, as DVC does
        remedy = "write the values that it names in another way"
        raise UserError(
            "YAML that cannot be changed in place", file=path, found=brief(str(error)), remedy=remedy
        ) from None
    for name, value in values.items():
        *folders, key = name.split(".")
        place = tree["subjects"][subject]
        for folder in folders:
            if not isinstance(place.get(folder), dict):
                place[folder] = CommentedMap()
                place[folder].fa.set_flow_style()
            place = place[folder]
        place[key] = value
    text = StringIO()
    yaml.dump(tree, text)
    with atomic_file(path) as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8")
        try:
            load_params(temporary)
        except UserError as error:
            raise UserError(
                "the values do not fit into params.yaml, which is unchanged",
                file=path,
                place=error.place,
                expected=error.expected,
                found=error.found,
                remedy="correct the values: docs/reference/params.md lists what each key takes",
            ) from None
