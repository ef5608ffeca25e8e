#!/bin/sh
# Check the prerequisites of set-up before anything is downloaded; print the interpreter to use.
# All missing prerequisites are listed together, with the command that installs them.
set -eu

missing="" # one line each
packages=""
lack() {
    missing="$missing
  - $1"
    packages="$packages $2"
}

version() { "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null; }

python=""
for candidate in ${PYTHON:-python3 python3.12 python3.11}; do
    case $(version "$candidate" || true) in 3.11 | 3.12) python=$candidate && break ;; esac
done

if [ -z "$python" ]; then
    tried=${PYTHON:-python3}
    lack "Python 3.11 or 3.12, for which wheels of ROS 2 Jazzy exist ($tried is: $(version "$tried" || echo absent))" \
        "python3.11 python3.11-venv python3.11-dev"
else
    name=python$(version "$python")
    "$python" -c 'import venv, ensurepip' 2>/dev/null ||
        lack "the modules venv and ensurepip of $python" "$name-venv"
    [ -f "$("$python" -c 'import sysconfig; print(sysconfig.get_paths()["include"])')/Python.h" ] ||
        lack "Python.h, the C headers of $python" "$name-dev"
fi
command -v g++ >/dev/null || lack "g++, the C++ compiler" "g++"
command -v make >/dev/null || lack "make" "make"

if [ -n "$missing" ]; then
    {
        echo "Set-up needs the following, which are missing:$missing"
        echo "Install it, as root or with sudo:"
        echo "  apt-get update && apt-get install -y$packages"
    } >&2
    exit 1
fi
echo "$python"
