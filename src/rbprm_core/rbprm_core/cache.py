"""A cache on disk for arrays that take long to compute, under a key of their inputs."""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import platformdirs
from numpy.typing import NDArray

Arrays = dict[str, NDArray[np.generic]]
"""Arrays by name."""

FOLDER_VARIABLE = "RBPRM_CACHE_DIR"


def cache_folder() -> Path:
    """Folder of the cache: that of the variable RBPRM_CACHE_DIR, else the user's cache folder."""
    return Path(os.environ.get(FOLDER_VARIABLE) or platformdirs.user_cache_dir("rbprm"))


def key_of(parts: Iterable[bytes]) -> str:
    """Hexadecimal key of a list of inputs, which also depends on where one input ends.

    Args:
        parts: the inputs.
    """
    digest = hashlib.sha256()
    for part in parts:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.hexdigest()[:32]


def cached(name: str, key: str, compute: Callable[[], Arrays]) -> Arrays:
    """Arrays of a name and key, read from the cache where they are complete, else computed.

    Computed arrays are written to the cache. Two processes may compute at the same time: each
    writes a temporary file and renames it, so a reader sees a complete file or none. Where the
    folder cannot be written, the arrays are computed at every call.

    Args:
        name: name of the data, a part of the file's name.
        key: key of the inputs that the data depend on.
        compute: function that computes the arrays.
    """
    path = cache_folder() / f"{name}-{key}.npz"
    try:
        with np.load(path, allow_pickle=False) as file:
            return dict(file)
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error):
        pass  # absent, or truncated by a full disk: compute the arrays again
    arrays = compute()
    with contextlib.suppress(OSError):
        _write(path, arrays)
    return arrays


def _write(path: Path, arrays: Arrays) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]
        Path(temporary).replace(path)
    except OSError:
        Path(temporary).unlink(missing_ok=True)
        raise
