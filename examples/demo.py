"""HyQ crosses the rubble, planned by the ROS 2 node: the steps of a mission executive.

There are three processes: the planner node from the built workspace, `publish_surfaces` in place of
perception, and this one. It calls the plan service, receives the contact sequence on its latched
topic, checks it independently of the planner, and writes it as plan file, picture and HTML page.

Run it by `make demo`, or in the workspace's environment: `scripts/in_workspace.sh
.venv/bin/python examples/demo.py [--scenario NAME] [--seed N] [--out FOLDER]`.
"""

from __future__ import annotations

import argparse
import contextlib
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import rclpy
from ament_index_python import get_package_prefix
from nav_msgs.msg import Path as PathMessage
from rbprm_msgs.msg import ContactSequence
from rbprm_msgs.srv import Plan
from rcl_interfaces.msg import Log
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rich.console import Console

from rbprm_core.check import check_plan
from rbprm_core.cli.plan import summary
from rbprm_core.errors import RbprmError
from rbprm_core.plan_record import ContactPlan
from rbprm_core.scenario import Scenario, load_scenario
from rbprm_core.view.page import write_page
from rbprm_core.view.picture import write_picture
from rbprm_ros.conversions import plan_of_messages, request_message
from rbprm_ros.rclpy_utils.qos import LATCHED

NODE = "/rbprm_planner"
START_TIMEOUT = 30.0  # seconds until node and surfaces are available
STOP_TIMEOUT = 5.0  # seconds from the stop signal to the end of a process
RETRY_PERIOD = 0.3  # seconds between calls until the surfaces have arrived


class DemoError(Exception):
    """A failure of the demo, with a text for the terminal."""


class Executive(Node):
    """A node that calls the planner and receives its topics.

    Args:
        show: function called with each line of the planner's log.
    """

    def __init__(self, show: Callable[[str], None]) -> None:
        super().__init__("executive")
        self.sequence: ContactSequence | None = None
        self.guide: PathMessage | None = None
        self._show = show
        self._plan = self.create_client(Plan, f"{NODE}/plan")
        self.create_subscription(
            ContactSequence, f"{NODE}/contact_sequence", self._on_sequence, LATCHED
        )
        self.create_subscription(PathMessage, f"{NODE}/guide_path", self._on_guide, LATCHED)
        self.create_subscription(Log, "/rosout", self._on_log, 100)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)

    def spin_until(
        self, done: Callable[[], bool], what: str, processes: Processes, timeout: float
    ) -> None:
        """Serve callbacks until a condition is true.

        Args:
            done: the condition.
            what: name of what the condition waits for, for the error.
            processes: processes that must keep running.
            timeout: longest time to wait, seconds.

        Raises:
            DemoError: a process ended, or the time is over.
        """
        end = time.monotonic() + timeout
        while not done():
            processes.require_up()
            if time.monotonic() > end:
                raise DemoError(f"no {what} within {timeout:g} s")
            self._executor.spin_once(0.05)

    def wait_for_planner(self, processes: Processes) -> None:
        """Wait until the plan service is available."""
        found = self._plan.service_is_ready
        self.spin_until(found, "plan service", processes, START_TIMEOUT)

    def plan(self, request: Plan.Request, processes: Processes, timeout: float) -> Plan.Response:
        """The answer of the plan service, called until the planner has received surfaces.

        Args:
            request: the request.
            processes: processes that must keep running.
            timeout: longest time to wait for one answer, seconds.
        """
        end = time.monotonic() + START_TIMEOUT
        while True:
            future = self._plan.call_async(request)
            self.spin_until(future.done, "answer of the plan service", processes, timeout)
            response = future.result()
            waiting = response.result.field == "surfaces" and time.monotonic() < end
            if not waiting:
                return response
            time.sleep(RETRY_PERIOD)

    def _on_sequence(self, message: ContactSequence) -> None:
        self.sequence = message

    def _on_guide(self, message: PathMessage) -> None:
        self.guide = message

    def _on_log(self, message: Log) -> None:
        if message.name == NODE.strip("/"):
            self._show(message.msg)


class Processes:
    """The other processes; their output goes to files in a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._running: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, name: str, *arguments: str) -> None:
        """Start an executable of the built workspace."""
        path = Path(get_package_prefix("rbprm_ros")) / "lib" / "rbprm_ros" / name
        with self._log(name).open("wb") as log:
            self._running[name] = subprocess.Popen(
                [path, *arguments], stdout=log, stderr=subprocess.STDOUT
            )

    def require_up(self) -> None:
        """Raise a DemoError where a process has ended."""
        for name, process in self._running.items():
            if process.poll() is not None:
                last = self._log(name).read_text().strip().splitlines()[-5:]
                raise DemoError("\n  ".join([f"{name} ended, exit code {process.poll()}:", *last]))

    def stop(self) -> list[str]:
        """Stop all processes; returns a text on each that did not end with exit code 0."""
        for process in self._running.values():
            process.send_signal(signal.SIGINT)
        complaints = []
        for name, process in self._running.items():
            try:
                code = process.wait(STOP_TIMEOUT)
            except subprocess.TimeoutExpired:
                process.kill()
                code = process.wait()
            if code != 0:
                complaints.append(f"{name} ended with exit code {code}, see {self._log(name)}")
        self._running = {}
        return complaints

    def _log(self, name: str) -> Path:
        return self._folder / f"{name}.log"


@contextlib.contextmanager
def running(scenario: str, folder: Path) -> Iterator[Processes]:
    """A context in which the planner node and the publisher of surfaces run."""
    processes = Processes(folder)
    try:
        # At level debug the node logs the stages of planning.
        processes.start("planner_node", "--ros-args", "--log-level", "rbprm_planner:=debug")
        processes.start("publish_surfaces", scenario)
        yield processes
        complaints = processes.stop()
    finally:
        processes.stop()
    if complaints:
        raise DemoError("; ".join(complaints))


def run(scenario: Scenario, name: str, seed: int, folder: Path, console: Console) -> ContactPlan:
    """The plan of a scenario, planned by the node and received on its topics.

    Args:
        scenario: the scenario.
        name: known name or file of the scenario.
        seed: seed of the planner.
        folder: folder for the output of the processes.
        console: console for progress.
    """
    robot = scenario.load_robot()
    limit = scenario.request_text(robot.name).time_limit
    request = request_message(scenario.request_for(robot, seed), robot.name, limit)
    with console.status("starting") as status, running(name, folder) as processes:

        def show(line: str) -> None:
            status.update(line)
            if not console.is_terminal and "robot data" in line:
                console.print(f"  {line}", highlight=False)

        executive = Executive(show)
        started = time.monotonic()
        executive.wait_for_planner(processes)
        console.print(f"planner node found after {time.monotonic() - started:.1f} s")
        started = time.monotonic()
        answer = executive.plan(request, processes, timeout=limit + 120.0)
        if answer.result.code != answer.result.SUCCESS:
            raise DemoError(f"the planner answers: {answer.result.text}")
        console.print(f"plan service answered after {time.monotonic() - started:.1f} s")

        def received() -> bool:
            sequence, guide = executive.sequence, executive.guide
            return (
                sequence is not None
                and guide is not None
                and sequence.sequence_id == answer.sequence.sequence_id
                and guide.header == sequence.header
            )

        executive.spin_until(received, "contact sequence on its topic", processes, 10.0)
        console.print(f"contact sequence received on {NODE}/contact_sequence")
        plan = plan_of_messages(
            executive.sequence, executive.guide, scenario.environment_entry(), answer.statistics
        )
        executive.destroy_node()
    return plan


def main() -> None:
    """Run the demo; the exit code is 0 if there is a valid plan."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scenario", default="rubble", help="known name or file")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("demo_output"), help="folder to write to")
    arguments = parser.parse_args()
    console = Console(highlight=False)
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # Ctrl-C stays KeyboardInterrupt
    try:
        scenario = load_scenario(arguments.scenario)
        folder: Path = arguments.out
        folder.mkdir(parents=True, exist_ok=True)
        plan = run(scenario, arguments.scenario, arguments.seed, folder, console)
        with console.status("checking"):
            report = check_plan(plan)
        console.print(summary(plan, report))
        for violation in report.violations:
            console.print(str(violation), style="red", markup=False)
        with console.status("drawing"):
            _write(plan, folder / scenario.name, console)
    except (DemoError, RbprmError) as error:
        console.print(f"demo: {error}", style="red", markup=False)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
    finally:
        rclpy.try_shutdown()
    sys.exit(0 if report.valid else 1)


def _write(plan: ContactPlan, stem: Path, console: Console) -> None:
    """Write plan file, picture and page, and print their names."""
    writers: dict[str, Callable[[Path], None]] = {
        ".plan.json": plan.write,
        ".png": lambda path: write_picture(plan, path),
        ".html": lambda path: write_page(plan, path),
    }
    for suffix, write in writers.items():
        path = stem.with_name(stem.name + suffix)
        write(path)
        console.print(f"written: {path}")


if __name__ == "__main__":
    main()
