"""Receive the planner's latched contact sequence without ROS, with Cyclone DDS.

    pip install cyclonedds
    python examples/foreign_peer/listen.py [--domain N] [--localhost] [--json]

Prints a summary of the sequence, or all of it as JSON, and ends. The DDS topic of a ROS
topic `/a/b` is `rt/a/b`.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from messages import ContactSequence

# ROS nodes with ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST do not use multicast. They are found on the
# loopback interface only, at the ports of the first participants of the machine.
LOCALHOST = """
<CycloneDDS><Domain id="any">
  <General>
    <Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>
    <AllowMulticast>false</AllowMulticast>
  </General>
  <Discovery>
    <ParticipantIndex>auto</ParticipantIndex>
    <MaxAutoParticipantIndex>100</MaxAutoParticipantIndex>
    <Peers><Peer Address="127.0.0.1"/></Peers>
  </Discovery>
</Domain></CycloneDDS>
"""

LATCHED = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.Durability.TransientLocal,
    Policy.History.KeepLast(1),
)


def receive(domain: int, topic: str, timeout: float) -> ContactSequence | None:
    """The newest sequence, None if none arrives in time.

    Args:
        domain: DDS domain of the planner.
        topic: DDS topic of the sequence.
        timeout: longest time to wait, seconds.
    """
    participant = DomainParticipant(domain)
    reader = DataReader(participant, Topic(participant, topic, ContactSequence), LATCHED)
    return next(reader.take_iter(timeout=duration(seconds=timeout)), None)


def main() -> None:
    """Print a sequence; the exit code is 1 if none arrives."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--domain", type=int, default=0, help="ROS_DOMAIN_ID of the planner")
    parser.add_argument(
        "--localhost", action="store_true", help="if the planner has LOCALHOST discovery"
    )
    parser.add_argument("--topic", default="/rbprm_planner/contact_sequence")
    parser.add_argument("--timeout", type=float, default=30.0, help="seconds")
    parser.add_argument("--json", action="store_true", help="print the whole sequence as JSON")
    arguments = parser.parse_args()
    settings = Domain(arguments.domain, LOCALHOST) if arguments.localhost else None
    sequence = receive(arguments.domain, f"rt{arguments.topic}", arguments.timeout)
    del settings  # in use as long as the object exists
    if sequence is None:
        sys.exit(f"no sequence on {arguments.topic} within {arguments.timeout:g} s")
    if arguments.json:
        print(json.dumps(asdict(sequence)))
        return
    print(f"{sequence.sequence_id} revision {sequence.revision}, {sequence.robot}:")
    for state in sequence.states:
        print(f"  {state.index:4d}  {' '.join(contact.limb for contact in state.contacts)}")


if __name__ == "__main__":
    main()
