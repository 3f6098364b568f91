"""Prints what topics of a bag of ROS 1 hold, as a JSON object."""

import json
import sys
from pathlib import Path

from rosbags.highlevel import AnyReader


def main():
    told = {}
    with AnyReader([Path(sys.argv[1])]) as reader:
        for connection, _, bytes in reader.messages():
            message = reader.deserialize(bytes, connection.msgtype)
            own = told.setdefault(connection.topic, {"type": connection.msgtype, "count": 0})
            own["count"] += 1
            if connection.topic == "/odom":
                own["y"] = message.pose.pose.position.y
    print(json.dumps(told))


if __name__ == "__main__":
    main()
