"""TOML files given by name, for those that come with the package, or by path."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from pathlib import Path

from rbprm_core.errors import InvalidInput


def known_files(package: str, folder: str) -> dict[str, Path]:
    """Path by stem of the TOML files in a folder of a package, sorted by stem.

    Args:
        package: name of the package.
        folder: path of the folder relative to the package.
    """
    root = Path(str(files(package))) / folder
    return {path.stem: path for path in sorted(root.glob("*.toml"))}


def read_toml(name: str, known: dict[str, Path], field: str) -> dict[str, object]:
    """Content of a TOML file.

    Args:
        name: a known name, or the path of a file.
        known: path by known name.
        field: name of the field that holds `name`, for errors.

    Raises:
        InvalidInput: neither a known name nor a readable TOML file.
    """
    path = known.get(name, Path(name))
    try:
        return tomllib.loads(path.read_text())
    except OSError as error:
        reason = f"neither a known name ({', '.join(known)}) nor a readable file"
        raise InvalidInput(field, name, reason) from error
    except ValueError as error:
        raise InvalidInput(field, name, f"is not a TOML file: {error}") from error
