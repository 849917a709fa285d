"""What there are several of: sources of captures, codecs, exporters, models. Another one is one file in a folder.

The modules of a registry's package are its entries, named as params.yaml or the command line names them. The names are
those of the files, so nothing is imported to know them: parameters are checked against them without what they stand
for. An entry is imported when it is asked for. `source_code` counts all entries of a registry to the code of a stage
that imports its package, since no import statement names them.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_ROOT = Path(__file__).resolve().parent


@dataclass(frozen=True)
class Registry:
    """The entries of one kind.

    Attributes:
        package: whose modules they are; its own module says what each has to offer.
    """

    package: str

    @property
    def names(self) -> tuple[str, ...]:
        """Sorted; modules whose names begin with _ are none."""
        folder = _ROOT.joinpath(*self.package.split(".")[1:])
        return tuple(sorted(path.stem for path in folder.glob("[!_]*.py")))

    def __getitem__(self, name: str) -> Any:
        """The module of an entry.

        Raises:
            KeyError: if there is none of this name.
        """
        if name not in self.names:
            raise KeyError(name)
        return importlib.import_module(f"{self.package}.{name}")


SOURCES = Registry("facefolds_core.captures.sources")
CODECS = Registry("facefolds_core.asset.codecs")
EXPORTERS = Registry("facefolds_core.engines")
MODELS = Registry("facefolds_core.training.trainers")
REGISTRIES = (SOURCES, CODECS, EXPORTERS, MODELS)
