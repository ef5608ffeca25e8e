"""One version number: in `rbprm_core.version`, and equal wherever a file has to repeat it."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

from rbprm_core.cli.main import cli
from rbprm_core.version import __version__

ROOT = Path(__file__).resolve().parents[2]
REPEATED = {  # files that cannot read the number, and how they have it
    "src/rbprm_core/package.xml": r"<version>(.*)</version>",
    "src/rbprm_ros/package.xml": r"<version>(.*)</version>",
    "msg_defs/rbprm_msgs/package.xml": r"<version>(.*)</version>",
    "src/rbprm_ros/pyproject.toml": r'^version = "(.*)"$',
    "CITATION.cff": r"^version: (.*)$",
    "CHANGELOG.md": r"^## (\d.*?)(?: .*)?$",  # the newest section that is closed
}


@pytest.mark.parametrize("file", REPEATED)
def test_files_that_repeat_the_number_agree(file: str) -> None:
    found = re.search(REPEATED[file], (ROOT / file).read_text(), re.MULTILINE)
    assert found is not None
    assert found[1] == __version__


def test_the_command_line_tells_the_version() -> None:
    result = CliRunner().invoke(cli, ["--version"])
    assert result.output == f"rbprm, version {__version__}\n"


@pytest.mark.parametrize("package", ["rbprm_core", "rbprm_ros"])
def test_metadata_of_the_packages(package: str) -> None:
    """They have what a package index shows, and the licence beside them."""
    folder = ROOT / "src" / package
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    assert project["name"] == package
    assert project["license"] == "BSD-3-Clause"
    assert 'python_requires=">=3.11"' in (folder / "setup.py").read_text()
    assert project["classifiers"]
    assert (folder / "LICENSE").read_text() == (ROOT / "LICENSE").read_text()
