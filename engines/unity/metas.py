"""Writes Unity's .meta files: a package without them is passed over. A file's GUID is made of its path, for ever.

python engines/unity/metas.py
"""

from __future__ import annotations

import hashlib
from pathlib import Path

PACKAGE = Path(__file__).parent / "com.facefolds.player"
IMPORTERS = {
    ".cs": "MonoImporter:\n  serializedVersion: 2\n  executionOrder: 0",
    ".asmdef": "AssemblyDefinitionImporter:",
    ".shader": "ShaderImporter:",
    ".hlsl": "ShaderIncludeImporter:",
    ".json": "PackageManifestImporter:",
    ".md": "TextScriptImporter:",
    "": "DefaultImporter:",
}


def imported() -> list[Path]:
    """What Unity imports: not what lies in a folder with a tilde."""
    found = [path for path in sorted(PACKAGE.rglob("*")) if path.suffix != ".meta"]
    return [path for path in found if not any(part.endswith("~") for part in path.relative_to(PACKAGE).parts)]


def meta(path: Path) -> str:
    guid = hashlib.md5(f"facefolds/{path.relative_to(PACKAGE).as_posix()}".encode()).hexdigest()
    rest = "folderAsset: yes\nDefaultImporter:" if path.is_dir() else IMPORTERS[path.suffix]
    return f"fileFormatVersion: 2\nguid: {guid}\n{rest}\n  externalObjects: {{}}\n  userData:\n"


if __name__ == "__main__":
    for one in imported():
        one.with_name(f"{one.name}.meta").write_text(meta(one))
