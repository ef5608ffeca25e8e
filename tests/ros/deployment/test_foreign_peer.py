"""A DDS peer of another vendor, in an environment without ROS, receives the latched sequence."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbprm_msgs.msg import SurfaceArray
from rbprm_msgs.srv import Plan

if TYPE_CHECKING:
    from conftest import Executive, Site

ROOT = Path(__file__).parents[3]
WITHOUT_ROS = ROOT / ".venv" / "peer" / "bin" / "python"  # made by `make test`
LISTEN = ROOT / "examples" / "foreign_peer" / "listen.py"


def listen(domain: int, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the example without this environment's variables."""
    command = [WITHOUT_ROS, LISTEN, "--localhost", f"--domain={domain}", *arguments]
    return subprocess.run(command, env={}, capture_output=True, text=True, timeout=120, check=False)


def test_environment_has_no_ros() -> None:
    command = [WITHOUT_ROS, "-c", "import rclpy"]
    done = subprocess.run(command, env={}, capture_output=True, text=True, timeout=120, check=False)
    assert "No module named 'rclpy'" in done.stderr


def test_latched_sequence_is_decoded(
    shared: Site,
    executive: Executive,
    ground: SurfaceArray,
    request_on_ground: Plan.Request,
    plain: Callable[[Any], Any],
) -> None:
    executive.listen()
    executive.publish(ground)
    response = executive.call_on_surfaces(request_on_ground)
    assert response.result.code == response.result.SUCCESS, response.result.text
    identity = response.sequence.sequence_id
    executive.spin_until(
        lambda: any(s.sequence_id == identity for s in executive.sequences[-1:]), "the sequence"
    )
    done = listen(shared.domain, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == plain(executive.sequences[-1])
    assert len(executive.sequences[-1].states) > 10
    table = listen(shared.domain).stdout
    assert f"{identity} revision 0, hyq" in table
    assert table.count("lf_leg") > 1


def test_no_sequence_is_said(site: Site) -> None:
    """Nothing is published here: the messages in the test above came from the planner's domain."""
    done = listen(site.domain, "--timeout=1")
    assert done.returncode == 1
    assert "no sequence on /rbprm_planner/contact_sequence within 1 s" in done.stderr
