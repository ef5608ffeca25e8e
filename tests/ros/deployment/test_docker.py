"""The names in the container files exist, and the entry point does what the files expect.

No image is built here; the entry point runs in the built workspace.
"""

from __future__ import annotations

import os
import re
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import yaml
from ament_index_python import get_package_prefix, get_package_share_directory

from rbprm_core.scenario import load_scenario

if TYPE_CHECKING:
    from conftest import Site

ROOT = Path(__file__).resolve().parents[3]
DOCKER = ROOT / "docker"
ENTRYPOINT = DOCKER / "entrypoint.sh"
DOCKERFILES = (DOCKER / "Dockerfile", DOCKER / "Dockerfile.ros")
WORKSPACE = Path(get_package_prefix("rbprm_ros")).parent
EXECUTABLES = {path.name for path in (WORKSPACE / "rbprm_ros" / "lib" / "rbprm_ros").iterdir()}
TALOS = Path(get_package_share_directory("rbprm_ros")) / "config" / "talos.yaml"
VARIABLE = re.compile(r"\$\{(\w+):-([^}]*)\}")
TIMEOUT = 150.0  # seconds; the robot's data may have to be computed first


def composed() -> dict[str, Any]:
    """The compose file without variables set."""
    text = VARIABLE.sub(r"\2", (DOCKER / "compose.yaml").read_text()).replace("$$", "$")
    parsed: dict[str, Any] = yaml.safe_load(text)
    return parsed


class Containers:
    """Commands run by the entry point as in containers, but without containers."""

    def __init__(self, site: Site) -> None:
        self._site = site
        self._running: list[tuple[subprocess.Popen[bytes], Path]] = []

    def start(self, *command: str, **environment: str) -> subprocess.Popen[bytes]:
        """Start a command in the environment of an image."""
        log = self._site.folder / f"{len(self._running)}.log"
        with log.open("wb") as file:
            popen = subprocess.Popen(
                [ENTRYPOINT, *command],
                stdout=file,
                stderr=subprocess.STDOUT,
                env={
                    **os.environ,
                    "ROS_DOMAIN_ID": str(self._site.domain),
                    "ROS_LOG_DIR": str(self._site.folder),
                    "RBPRM_WORKSPACE": str(WORKSPACE),
                    "RBPRM_ROBOT": "",
                    **environment,
                },
            )
        self._running.append((popen, log))
        return popen

    def log(self, popen: subprocess.Popen[bytes]) -> str:
        """The output of a command."""
        return next(log.read_text() for other, log in self._running if other is popen)

    def wait_for(self, text: str, popen: subprocess.Popen[bytes]) -> None:
        """Wait until a text is in the output of a command."""
        end = time.monotonic() + TIMEOUT
        while text not in self.log(popen):
            assert popen.poll() is None, self.log(popen)
            assert time.monotonic() < end, self.log(popen)
            time.sleep(0.1)

    def close(self) -> None:
        """End all commands."""
        for popen, _ in self._running:
            popen.terminate()
        for popen, _ in self._running:
            popen.wait(60.0)


@pytest.fixture
def containers(site: Site) -> Iterator[Containers]:
    """Runs commands by the entry point in a domain for one test."""
    made = Containers(site)
    yield made
    made.close()


def test_compose_starts_what_is_installed() -> None:
    commands = {name: service["command"] for name, service in composed()["services"].items()}
    assert commands.keys() == {"planner", "executive", "recorder"}
    for first, *rest in commands.values():
        called = re.search(r"exec (\w+)", rest[-1]) if first == "bash" else None
        assert (called[1] if called else first) in EXECUTABLES


def test_compose_reads_the_variables_that_it_names() -> None:
    comment, _, rest = (DOCKER / "compose.yaml").read_text().partition("x-rbprm:")
    named = set(re.findall(r"\b(?:RBPRM|ROS)_[A-Z_]+\b", comment))
    assert named == {name for name, _ in VARIABLE.findall(rest)}


def test_compose_gives_the_planner_the_robot_of_the_scenario() -> None:
    file = composed()
    scenario = file["services"]["executive"]["command"][-1].removeprefix("scenario:=")
    assert load_scenario(scenario).robot == file["x-rbprm"]["environment"]["RBPRM_ROBOT"]


def test_compose_mounts_the_volumes_that_it_declares() -> None:
    file = composed()
    assert (DOCKER / file["x-rbprm"]["build"]["context"]).resolve() == ROOT
    assert ROOT / file["x-rbprm"]["build"]["dockerfile"] in DOCKERFILES
    services = file["services"].values()
    mounted = {entry.partition(":")[0] for s in services for entry in s.get("volumes", ())}
    assert mounted == file["volumes"].keys()


@pytest.mark.parametrize("file", DOCKERFILES, ids=lambda file: file.name)
def test_dockerfile_names_what_is_there(file: Path) -> None:
    text = file.read_text()
    paths = re.findall(r"(?<![\w/.])(?:docker|requirements|scripts|src)/[\w./-]+\w", text)
    assert "docker/entrypoint.sh" in paths
    assert [path for path in paths if not (ROOT / path).exists()] == []
    assert os.access(ENTRYPOINT, os.X_OK)
    commands = re.findall(r'^CMD \["(?:ros2", "run", "rbprm_ros", ")?(\w+)"\]$', text, re.M)
    assert len(commands) == 1
    assert set(commands) <= EXECUTABLES


@pytest.mark.parametrize(
    "script", [ENTRYPOINT, *sorted((ROOT / "scripts").glob("*.sh"))], ids=lambda path: path.name
)
def test_scripts_can_be_parsed(script: Path) -> None:
    shell = script.read_text().partition("\n")[0].removeprefix("#!")
    assert subprocess.run([shell, "-n", script], timeout=60, check=False).returncode == 0


def test_health_is_that_of_the_planner(containers: Containers) -> None:
    asked = ("check_health", "--ros-args", "-p", "timeout:=2.0")
    assert containers.start(*asked).wait(60.0) == 1
    planner = containers.start("planner_node", RBPRM_ROBOT="anymal")
    containers.wait_for("up; frame", planner)
    # As in the file, with more time for a busy machine.
    assert containers.start("check_health", "--ros-args", "-p", "timeout:=20.0").wait(60.0) == 0
    containers.wait_for("anymal: robot data", planner)


def test_parameter_file_says_the_robot_where_the_environment_does_not(
    containers: Containers,
) -> None:
    planner = containers.start("planner_node", "--ros-args", "--params-file", str(TALOS))
    containers.wait_for("talos: robot data", planner)


def test_services_of_the_compose_file_work_together(containers: Containers) -> None:
    file = composed()
    environment = {"RBPRM_ROBOT": file["x-rbprm"]["environment"]["RBPRM_ROBOT"]}
    planner, executive = (
        containers.start(*file["services"][name]["command"], **environment)
        for name in ("planner", "executive")
    )
    containers.wait_for("is ready", planner)
    containers.wait_for("plan of", executive)
    containers.wait_for("edit: ", executive)
