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
from typing import IO, Any, Literal

import numpy as np
from numpy.typing import NDArray

from facefolds_core.errors import UserError
from facefolds_core.files.reading import check_regular, no_memory, remake

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


def read_npz(
    path: Path, message: str, names: Collection[str] | None = None, mapped: bool = False
) -> dict[str, NDArray[Any]]:
    """The arrays of an archive of `np.savez` by name; all, or those of `names` that are there.

    Args:
        message: of the error, if the archive is damaged.
        mapped: read-only arrays that stay in the file: the memory that they take can be had back at any time.

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
                name: (_mapped if mapped else _array)(archive, member, size)
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
    with _opened(archive, member, size) as stream:
        data = io.BytesIO(stream.read())
    _header(data, member)
    data.seek(0)
    return np.asarray(np.lib.format.read_array(data, allow_pickle=False))


def _mapped(archive: zipfile.ZipFile, member: zipfile.ZipInfo, size: int) -> NDArray[Any]:
    """The same where it lies in the file, after its checksum was compared."""
    with _opened(archive, member, size) as stream:
        shape, columns_first, kind = _header(stream, member)
        start = stream.tell()
        while stream.read(1 << 20):
            pass
    file = archive.fp
    assert file is not None
    file.seek(member.header_offset)
    local = struct.unpack("<4s5H3I2H", file.read(30))  # the entry's own header: its name and more lie before the data
    offset = member.header_offset + 30 + local[-2] + local[-1] + start
    order: Literal["F", "C"] = "F" if columns_first else "C"
    return np.memmap(file, kind, "r", offset=offset, shape=shape, order=order).view(np.ndarray)


def _opened(archive: zipfile.ZipFile, member: zipfile.ZipInfo, size: int) -> IO[bytes]:
    if member.compress_type != zipfile.ZIP_STORED or member.file_size > size:
        raise ValueError(f"{member.filename}: {member.file_size} bytes in a file of {size}")
    return archive.open(member)


def _header(data: IO[bytes], member: zipfile.ZipInfo) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, whether columns come first, and type: those of as many bytes as follow."""
    version = np.lib.format.read_magic(data)
    if version != (1, 0):
        raise ValueError(f"{member.filename}: an array of format {version}")
    shape, columns_first, kind = np.lib.format.read_array_header_1_0(data)
    if math.prod(shape) * kind.itemsize != member.file_size - data.tell() or kind.hasobject:
        raise ValueError(f"{member.filename}: {member.file_size} bytes are no array {shape} of {kind}")
    return shape, columns_first, kind
