"""npz archives of earlier stages, read without trust: no pickles, nothing larger than the file itself.

`np.savez` stores arrays uncompressed with a CRC each. So a member that unpacks to more than it takes, or an array whose
header promises more bytes than follow, is damage (or a bomb), and is refused before memory is asked for.
"""

from __future__ import annotations

import errno
import io
import math
import struct
import zipfile
import zlib
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.reading import check_regular, no_memory, remake

_DAMAGE = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    ValueError,
    EOFError,
    KeyError,
    TypeError,
    IndexError,
    OverflowError,
    SyntaxError,
    RuntimeError,  # flags that make zipfile look for a password; NotImplementedError, for other compressions
    OSError,
)


def read_npz(path: Path, message: str, names: Collection[str] | None = None) -> dict[str, NDArray[Any]]:
    """The arrays of an archive of `np.savez` by name; all, or those of `names` that are there.

    Args:
        message: of the error, if the archive is damaged.

    Raises:
        UserError: if the file is missing, not a regular file, damaged, or too large for the memory.
    """
    size = check_regular(path, remake(path))
    try:
        with zipfile.ZipFile(path) as archive:
            members = {member.filename.removesuffix(".npy"): member for member in archive.infolist()}
            if len(members) != len(archive.infolist()):
                raise ValueError("two arrays of one name")
            return {
                name: _array(archive, member, size)
                for name, member in members.items()
                if names is None or name in names
            }
    except MemoryError:
        raise no_memory(path) from None
    except _DAMAGE as error:
        if isinstance(error, OSError) and error.errno == errno.ENOMEM:
            raise no_memory(path) from None
        if isinstance(error, PermissionError):
            raise
        raise UserError(message, file=path, found=str(error) or type(error).__name__, remedy=remake(path)) from None


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo, size: int) -> NDArray[Any]:
    """One array; ValueError for anything that `np.savez` does not write."""
    if member.compress_type != zipfile.ZIP_STORED or member.file_size > size:
        raise ValueError(f"{member.filename}: {member.file_size} bytes in a file of {size}")
    data = io.BytesIO(archive.read(member))
    version = np.lib.format.read_magic(data)
    if version != (1, 0):
        raise ValueError(f"{member.filename}: an array of format {version}")
    shape, _, kind = np.lib.format.read_array_header_1_0(data)
    if math.prod(shape) * kind.itemsize != member.file_size - data.tell() or kind.hasobject:
        raise ValueError(f"{member.filename}: {member.file_size} bytes are no array {shape} of {kind}")
    data.seek(0)
    return np.asarray(np.lib.format.read_array(data, allow_pickle=False))
