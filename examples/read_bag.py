"""Print the contact sequences of a bag of the planner, or all its messages as JSON.

It needs `rosbags` (pip install rosbags), but neither ROS nor rbprm, since the bag contains the
definitions of its messages.

    python examples/read_bag.py FOLDER [--json]
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.highlevel import AnyReader


def messages(bag: Path) -> Iterator[tuple[str, int, Any]]:
    """Topic, time of recording in nanoseconds, and content of each message of a bag."""
    with AnyReader([bag]) as reader:
        for connection, stamp, data in reader.messages():
            yield connection.topic, stamp, reader.deserialize(data, connection.msgtype)


def plain(value: Any) -> Any:
    """A value of a message as dictionaries, lists, texts and numbers."""
    if dataclasses.is_dataclass(value):
        # Fields with a default are constants and the name of the type.
        fields = [f.name for f in dataclasses.fields(value) if f.default is dataclasses.MISSING]
        return {name: plain(getattr(value, name)) for name in fields}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list):
        return [plain(item) for item in value]
    return value


def main() -> None:
    """Print the content of a bag."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("bag", type=Path, help="folder of the bag")
    parser.add_argument("--json", action="store_true", help="every message as a line of JSON")
    arguments = parser.parse_args()
    for topic, stamp, message in messages(arguments.bag):
        if arguments.json:
            print(json.dumps({"topic": topic, "stamp": stamp, "message": plain(message)}))
        elif topic.endswith("/contact_sequence"):
            print(f"{message.sequence_id} revision {message.revision}, {message.robot}:")
            for state in message.states:
                root, limbs = state.root.position, [contact.limb for contact in state.contacts]
                place = f"({root.x:6.2f} {root.y:6.2f} {root.z:6.2f}) m"
                print(f"  {state.index:4d}  {place}  {state.robustness:7.1f} N  {' '.join(limbs)}")


if __name__ == "__main__":
    main()
