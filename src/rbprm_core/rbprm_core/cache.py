"""Results that depend on a robot alone, kept on disk under a key of their inputs."""

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

FOLDER_VARIABLE = "RBPRM_CACHE_DIR"


def cache_folder() -> Path:
    """Where results are kept: RBPRM_CACHE_DIR, else the user's cache folder."""
    return Path(os.environ.get(FOLDER_VARIABLE) or platformdirs.user_cache_dir("rbprm"))


def key_of(parts: Iterable[bytes]) -> str:
    """Key of a list of inputs; where one ends and the next begins counts."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(len(part).to_bytes(8, "little"))
        digest.update(part)
    return digest.hexdigest()[:32]


def cached(name: str, key: str, compute: Callable[[], Arrays]) -> Arrays:
    """Arrays under a name and key: read where they are kept whole, else computed and kept.

    Two processes may compute at once: each writes a file of its own and renames it, so a reader
    sees a whole file or none. A folder that cannot be written costs the time, not the result.
    """
    path = cache_folder() / f"{name}-{key}.npz"
    try:
        with np.load(path, allow_pickle=False) as kept:
            return dict(kept)
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error):
        pass  # absent, or cut short by a full disk: make it again
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
