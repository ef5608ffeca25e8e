"""The SROS 2 policy allows everything that the nodes have in the ROS graph.

Nothing is encrypted here (docs/security.md). The commands are those of the document. A node with an
entity that the profile of its enclave does not allow would not start with security.
"""

from __future__ import annotations

import re
import shlex
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import pytest
from rclpy.node import Node

if TYPE_CHECKING:
    from conftest import Process, Site

ROOT = Path(__file__).resolve().parents[3]
POLICY = ElementTree.parse(ROOT / "examples" / "security" / "policy.xml").getroot()
DOCUMENT = ROOT / "docs" / "security.md"
PLANNER = "/rbprm_planner/"

# From sros2's policy.xsd: child elements and attributes of each element.
CHILDREN = {
    "policy": {"enclaves"},
    "enclaves": {"enclave"},
    "enclave": {"profiles"},
    "profiles": {"profile"},
    "profile": {"topics", "services", "actions"},
    "topics": {"topic"},
    "services": {"service"},
    "actions": {"action"},
}
REQUIRED = {"policy": {"version"}, "enclave": {"path"}, "profile": {"ns", "node"}}
RULES = {
    "topics": {"publish", "subscribe"},
    "services": {"request", "reply"},
    "actions": {"call", "execute"},
}
# Services and topics of an action, and the rights of its client and server (sros2's
# permissions.xsl).
ACTION_SERVICES = ("send_goal", "cancel_goal", "get_result")
ACTION_TOPICS = ("feedback", "status")
OF_ACTIONS = {"call": ("request", "subscribe"), "execute": ("reply", "publish")}

# Text that the process of each enclave logs when it works; the executive, when it executes.
UP = {"/planner": "is ready", "/perception": "surfaces on", "/executive": "plan of"}

LOG_LEVEL = ("--log-level", "rbprm_planner:=debug")  # it logs accepted surfaces

RESTING = 10  # equal snapshots of the graph, 0.1 s apart, after which it counts as settled
TIMEOUT = 150.0  # seconds

Rights = dict[str, set[str]]  # names by "publish", "subscribe", "request" and "reply"


def no_rights() -> Rights:
    """Empty rights, or no entities."""
    return {right: set() for right in ("publish", "subscribe", "request", "reply")}


def expanded(name: str, profile: ElementTree.Element) -> str:
    """A name of the policy, as sros2 expands it."""
    namespace = profile.get("ns", "").rstrip("/")
    if name.startswith("~"):
        return f"{namespace}/{profile.get('node')}{name[1:]}"
    return name if name.startswith("/") else f"{namespace}/{name}"


def allowed(profile: ElementTree.Element) -> Rights:
    """The rights of a profile; those of an action are rights to its services and topics."""
    rights = no_rights()
    for rules in profile:
        names = [expanded(str(entry.text), profile) for entry in rules]
        for right in rules.attrib:
            if right not in OF_ACTIONS:
                rights[right].update(names)
                continue
            serving, telling = OF_ACTIONS[right]
            rights[serving].update(f"{n}/_action/{s}" for n in names for s in ACTION_SERVICES)
            rights[telling].update(f"{n}/_action/{t}" for n in names for t in ACTION_TOPICS)
    return rights


PROFILES = {
    str(enclave.get("path")): profile
    for enclave in POLICY.iter("enclave")
    for profile in enclave.iter("profile")
}
ALLOWED = {enclave: allowed(profile) for enclave, profile in PROFILES.items()}


def commands() -> dict[str, list[str]]:
    """Executable and arguments of each enclave's process, from the document."""
    found = re.findall(r"^ +ros2 run rbprm_ros (.*--enclave (\S+).*)$", DOCUMENT.read_text(), re.M)
    return {enclave: shlex.split(command) for command, enclave in found}


def had(looker: Node, enclave: str) -> Rights:
    """The entities of an enclave's node in the ROS graph; none where the node is not found."""
    profile = PROFILES[enclave]
    name, namespace = str(profile.get("node")), str(profile.get("ns"))
    if (name, namespace) not in looker.get_node_names_and_namespaces():
        return no_rights()
    looks = {
        "publish": looker.get_publisher_names_and_types_by_node,
        "subscribe": looker.get_subscriber_names_and_types_by_node,
        "request": looker.get_client_names_and_types_by_node,
        "reply": looker.get_service_names_and_types_by_node,
    }
    return {right: {entry for entry, _ in look(name, namespace)} for right, look in looks.items()}


def excess(looker: Node, enclave: str) -> Rights:
    """The entities of a node that its profile does not allow, once the graph has settled."""
    looks = [had(looker, enclave)]
    end = time.monotonic() + TIMEOUT
    while not looks[-1]["reply"] or looks[-RESTING:] != [looks[-1]] * RESTING:
        assert time.monotonic() < end, f"no rest in the graph of {enclave}: {looks[-1]}"
        time.sleep(0.1)
        looks.append(had(looker, enclave))
    found = {right: looks[-1][right] - ALLOWED[enclave][right] for right in looks[-1]}
    return {right: names for right, names in found.items() if names}


def wait_for(text: str, process: Process) -> None:
    """Wait until a process logs a text; the robot's data may have to be computed first."""
    end = time.monotonic() + TIMEOUT
    while text not in process.log.read_text():
        assert process.popen.poll() is None, process.log.read_text()
        assert time.monotonic() < end, process.log.read_text()
        time.sleep(0.1)


@pytest.fixture
def looker(site: Site) -> Iterator[Node]:
    """A node that observes the ROS graph."""
    made = Node("looker", context=site.context)
    yield made
    made.destroy_node()


def test_policy_is_as_the_schema_wants_it() -> None:
    assert POLICY.tag == "policy"
    assert POLICY.get("version") == "0.2.0"
    for element in POLICY.iter():
        assert {child.tag for child in element} <= CHILDREN.get(element.tag, set())
        assert len(element) > 0 or element.tag not in CHILDREN, element.tag
        rules = RULES.get(element.tag, set())
        assert set(element.attrib) <= rules | REQUIRED.get(element.tag, set())
        assert set(element.attrib) >= REQUIRED.get(element.tag, set())
        assert all(element.get(rule) in (None, "ALLOW") for rule in rules)
    assert len(PROFILES) == len(list(POLICY.iter("profile")))


def test_only_the_executive_calls_the_planner() -> None:
    for enclave, rights in ALLOWED.items():
        called = {name for name in rights["request"] if name.startswith(PLANNER)}
        assert bool(called) == (enclave == "/executive")
    assert ALLOWED["/executive"]["request"] <= ALLOWED["/planner"]["reply"]


def test_nobody_manages_the_planner_or_speaks_in_its_name() -> None:
    nobodys = {"change_state", "set_parameters", "set_parameters_atomically", "set_environment"}
    own = {"contact_sequence", "partial_sequence", "guide_path", "status", "markers"}
    for enclave, rights in ALLOWED.items():
        assert not rights["request"] & {PLANNER + name for name in nobodys}
        if enclave != "/planner":
            assert not rights["publish"] & {PLANNER + name for name in own}
            assert not any(name.startswith(PLANNER) for name in rights["reply"])
    senders = {e for e, rights in ALLOWED.items() if f"{PLANNER}surfaces" in rights["publish"]}
    assert senders == {"/perception"}


def test_nodes_as_the_document_starts_them_have_what_they_may(site: Site, looker: Node) -> None:
    assert commands().keys() == UP.keys() == PROFILES.keys()
    running: dict[str, Process] = {}
    for enclave, command in commands().items():
        running[enclave] = site.start(*command, *LOG_LEVEL)
        wait_for(UP[enclave], running[enclave])
        if enclave == "/perception":
            wait_for("surfaces 1:", running["/planner"])  # for the executive's plan
    assert {enclave: excess(looker, enclave) for enclave in UP} == {enclave: {} for enclave in UP}


def test_an_executive_that_plays_perception_has_more_than_it_may(site: Site, looker: Node) -> None:
    """The reason why the document disables it; this also tests the comparison."""
    site.start("executive")
    assert excess(looker, "/executive") == {"publish": {f"{PLANNER}surfaces"}}
