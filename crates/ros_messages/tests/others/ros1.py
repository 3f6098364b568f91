"""Reads messages of ROS 1, a JSON object a line, and prints what they hold and the checksums of their definitions."""

import json
import sys

from read import tree
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


def of_ros1(value):
    """Without what that library adds to a message without fields."""
    if isinstance(value, list):
        return [of_ros1(item) for item in value]
    if isinstance(value, dict):
        names = [name for name in value if name != "structure_needs_at_least_one_member"]
        return {name: of_ros1(value[name]) for name in names}
    return value


def main():
    noetic = get_typestore(Stores.ROS1_NOETIC)
    for line in sys.stdin:
        line = json.loads(line)
        package, short = line["name"].split("/")
        name = f"{package}/msg/{short}"
        own = get_typestore(Stores.EMPTY)
        own.register(get_types_from_msg(line["text"], name))
        told = {
            "checksum": own.generate_msgdef(name, ros_version=1)[1],
            "ros": noetic.generate_msgdef(name, ros_version=1)[1] if name in noetic.types else None,
            "values": [of_ros1(tree(own.deserialize_ros1(bytes(message), name))) for message in line["messages"]],
        }
        print(json.dumps(told))


if __name__ == "__main__":
    main()
