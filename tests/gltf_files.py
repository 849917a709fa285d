"""GLB files: taken apart, put together again, and what Khronos' validator says of them."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
VALIDATE = """
const fs = require("fs"), validator = require("gltf-validator");
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1]))).then(r => console.log(JSON.stringify(r)));
"""


def opened(path: Path) -> tuple[dict[str, Any], bytes]:
    """The JSON and the binary chunk."""
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def part(document: dict[str, Any], binary: bytes, view: int) -> bytes:
    """The bytes of a buffer view."""
    entry = document["bufferViews"][view]
    return binary[entry["byteOffset"] : entry["byteOffset"] + entry["byteLength"]]


def validator_report(path: Path) -> dict[str, Any]:
    """What gltf-validator says; the test is skipped where it is not installed."""
    if shutil.which("node") is None or not (ROOT / "node_modules" / "gltf-validator").is_dir():
        pytest.skip("no gltf-validator: install Node.js and run `npm install --no-save gltf-validator`")
    command = ["node", "-e", VALIDATE, str(path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def complaints(report: dict[str, Any]) -> list[dict[str, Any]]:
    """Errors and warnings of a report."""
    return [message for message in report["issues"]["messages"] if message["severity"] <= 1]
