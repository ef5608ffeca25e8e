"""Files of installed packages, such as URDFs and meshes, named relative to a `share` folder.

Names such as `example-robot-data/robots/hyq_description/...` do not depend on the machine.
"""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path

from rbprm_core.errors import InvalidInput

PATH_VARIABLE = "RBPRM_SHARE_PATH"


def share_folders() -> list[Path]:
    """Existing folders that are searched for resources, in order.

    They are the folders of RBPRM_SHARE_PATH, then `share` in the prefixes of ament, of cmeel and of
    Python.
    """
    folders = [Path(p) for p in os.environ.get(PATH_VARIABLE, "").split(os.pathsep) if p]
    prefixes = [Path(p) for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
    spec = find_spec("cmeel")
    if spec is not None and spec.origin is not None:
        prefixes.append(Path(spec.origin).parents[1] / "cmeel.prefix")
    prefixes.append(Path(sys.prefix))
    folders += [prefix / "share" for prefix in prefixes]
    return [folder for folder in dict.fromkeys(folders) if folder.is_dir()]


def find_resource(name: str, field: str) -> Path:
    """Absolute path of a file.

    Args:
        name: path of the file, absolute or relative to a `share` folder.
        field: name of the field that holds `name`, for errors.

    Raises:
        InvalidInput: no such file; the reason lists the folders searched.
    """
    if Path(name).is_absolute():
        candidates = [Path(name)]
    else:
        candidates = [folder / name for folder in share_folders()]
    for path in candidates:
        if path.is_file():
            return path
    searched = ", ".join(str(path.parent) for path in candidates)
    raise InvalidInput(
        field, name, f"no such file; searched {searched}; {PATH_VARIABLE} adds folders"
    )
