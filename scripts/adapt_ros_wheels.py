"""Step 4 of set-up: adapt the ROS wheels in this .venv to colcon and to a shell.

1. Their CMake exports contain folders of the machine that built them; these are replaced by the
   folders of this machine.
2. The setup.bash of a workspace sources <prefix>/local_setup.bash of the prefix it was built on;
   .venv gets such a file, so that `. ros2_ws/install/setup.bash` works in an empty environment.

The script is run by the interpreter of the .venv. Running it again changes nothing.
"""

from __future__ import annotations

import re
import sys
import sysconfig
from pathlib import Path

import numpy as np

PREFIX = Path(sys.prefix)
BUILD_PYTHON = r"/opt/python/cp3\d+-cp3\d+"
REPLACEMENTS = {
    rf"{BUILD_PYTHON}/lib/python3\.\d+/site-packages/numpy/\w+/include": np.get_include(),
    rf"{BUILD_PYTHON}/include/python3\.\d+": sysconfig.get_paths()["include"],
}

LOCAL_SETUP = """\
# Makes this .venv the underlay of a ROS 2 workspace, like /opt/ros/<distro>. Made by {script}.
_rbprm_prepend() {{
    eval "_rbprm_old=\\${{$1:-}}"
    case ":$_rbprm_old:" in
    *":$2:"*) ;;
    *) eval "export $1=\\"$2\\${{_rbprm_old:+:\\$_rbprm_old}}\\"" ;;
    esac
    unset _rbprm_old
}}
# An empty environment has neither variable: bash does not export its PATH, and ROS logs below HOME.
export PATH="${{PATH:-/usr/local/bin:/usr/bin:/bin}}"
if [ -z "${{HOME:-}}" ]; then
    HOME=$(getent passwd "$(id -u)" | cut -d: -f6)
    export HOME="${{HOME:-/tmp}}"
fi
_rbprm_prepend AMENT_PREFIX_PATH "{prefix}"
_rbprm_prepend CMAKE_PREFIX_PATH "{prefix}"
_rbprm_prepend PATH "{prefix}/bin"
unset -f _rbprm_prepend
export ROS_VERSION=2 ROS_PYTHON_VERSION=3 ROS_DISTRO=jazzy
# Left by another Python with ROS wheels, it would keep this one from finding its libraries.
unset _ROS_WHEELS_BOOTSTRAP_COMPLETE
"""


def patch_exports() -> int:
    """Replace the folders in <prefix>/share/**/*.cmake; return the number of files changed."""
    changed = 0
    for path in (PREFIX / "share").rglob("*.cmake"):
        text = before = path.read_text()
        for pattern, replacement in REPLACEMENTS.items():
            text = re.sub(pattern, lambda _, new=replacement: new, text)  # type: ignore[misc]
        if text != before:
            path.write_text(text)
            changed += 1
    return changed


def write_setup_files() -> None:
    """Write the files local_setup.* and setup.* for sh, bash and zsh."""
    script = Path(__file__).name
    (PREFIX / "local_setup.sh").write_text(LOCAL_SETUP.format(script=script, prefix=PREFIX))
    source = f'. "{PREFIX}/local_setup.sh"\n'
    for name in ("setup.sh", "setup.bash", "setup.zsh", "local_setup.bash", "local_setup.zsh"):
        (PREFIX / name).write_text(source)


if __name__ == "__main__":
    print(f"      {patch_exports()} CMake exports rewritten")
    write_setup_files()
