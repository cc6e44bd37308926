"""Arrays kept on disk by the hash of what they were computed from; a damaged file is as good as none."""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import platformdirs

from models.errors import OkiagariError

Arrays = Mapping[str, np.ndarray]

_MAGIC = b"okiagari-library\n"
_DIGEST = hashlib.sha256().digest_size


class CacheError(OkiagariError):
    """The cache directory cannot be used."""


def default_directory() -> Path:
    """The user's cache directory of this program."""
    return Path(platformdirs.user_cache_dir("okiagari"))


def content_key(parts: Arrays) -> str:
    """Hash of names, types, shapes and bytes of all parts; their order does not matter."""
    digest = hashlib.sha256()
    for name in sorted(parts):
        array = np.ascontiguousarray(parts[name])
        for piece in (name.encode(), array.dtype.str.encode(), repr(array.shape).encode(), array.tobytes()):
            # Lengths keep two neighbours from reading like two others.
            digest.update(len(piece).to_bytes(8, "little"))
            digest.update(piece)
    return digest.hexdigest()


def load_or_build(key: str, build: Callable[[], Arrays], directory: Path | None = None) -> tuple[Arrays, bool]:
    """Arrays of `key` from disk, or built and stored there.

    Two processes that build at once both write whole files; the later one stays. A file that is truncated,
    altered or of another key is built anew and replaced.

    Args:
        key: `content_key` of every input and of the version of the format.
        build: computes the arrays.
        directory: where to keep them; the user's cache directory if None.

    Returns:
        the arrays, and whether they came from disk.

    Raises:
        CacheError: the directory cannot be made or written.
    """
    path = (default_directory() if directory is None else Path(directory)) / f"{key}.references"
    found = _read(path, key)
    if found is not None:
        return found, True
    arrays = build()
    _write(path, key, arrays)
    return arrays, False


def _read(path: Path, key: str) -> Arrays | None:
    try:
        content = path.read_bytes()
    except OSError:
        return None
    head = len(_MAGIC) + _DIGEST
    payload = content[head:]
    if content[: len(_MAGIC)] != _MAGIC or content[len(_MAGIC) : head] != _digest(key, payload):
        return None
    try:
        with np.load(io.BytesIO(payload), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (ValueError, OSError, zipfile.BadZipFile):
        # The digest holds, so this is what another version of numpy wrote.
        return None


def _write(path: Path, key: str, arrays: Arrays) -> None:
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **arrays)
    payload = stream.getvalue()
    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(prefix=f".{path.stem[:16]}-", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(_MAGIC + _digest(key, payload) + payload)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        if temporary is not None:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
        raise CacheError(
            f"the library cannot be kept in {path.parent}: {error.strerror}; give another directory"
        ) from error


def _digest(key: str, payload: bytes) -> bytes:
    return hashlib.sha256(key.encode() + payload).digest()
