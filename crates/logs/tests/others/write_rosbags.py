"""Writes a recording of ROS 1 in each compression with a message of each type that ROS 1 brings, one of a type that only its own
definition knows, and a recording of ROS 2 in a folder; prints what each message holds: one JSON object a line."""

import dataclasses
import itertools
import json
import math
import sys
from pathlib import Path

import numpy
from rosbags.interfaces import Nodetype
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

OWN = """\
# A type of one's own.
int32 GREATEST=7
string NAME=no # comment
byte level
char letter
bool[2] flags
time[] times
duration wait
Header header
geometry_msgs/Point[2] corners
string[] names
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
"""

numbers = itertools.cycle(range(1, 100))


def made(store, description):
    """Another value each time."""
    kind, inside = description
    if kind == Nodetype.NAME:
        return store.types[inside](**{name: made(store, field) for name, field in store.fielddefs[inside][1]})
    if kind == Nodetype.BASE:
        name, number = inside[0], next(numbers)
        if name == "string":
            return "ä" * (number % 5)
        if name == "bool":
            return number % 2 == 0
        return number + 0.5 if name.startswith("float") else number
    item, size = inside
    items = [made(store, item) for _ in range(size if kind == Nodetype.ARRAY else next(numbers) % 4)]
    if item[0] == Nodetype.BASE and item[1][0] != "string":
        name = item[1][0]
        kinds = {"byte": "int8", "char": "uint8", "octet": "uint8"}
        return numpy.array(items, dtype=kinds.get(name, name))
    return items


def tree(value):
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (bytes, list, tuple)):
        return [tree(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value) if not field.name.startswith("__")]
        own = {name.rstrip("_"): tree(getattr(value, name)) for name in names if not name.isupper() or len(name) == 1}
        if type(value).__name__.endswith("Header") and "frame_id" in own:
            # ROS 2 does not have it.
            own.pop("seq", None)
        own.pop("structure_needs_at_least_one_member", None)
        return own
    return value


def tell(bag, topic, time, value):
    print(json.dumps({"bag": bag, "topic": topic, "time": time, "value": tree(value)}))


def main(folder):
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg(OWN, "test_msgs/msg/Own"))
    names = sorted(store.fielddefs)
    for how in [None, Writer1.CompressionFormat.BZ2, Writer1.CompressionFormat.LZ4]:
        name = f"{how.name.lower() if how else 'none'}.bag"
        writer = Writer1(folder / name)
        if how:
            writer.set_compression(how)
        with writer:
            for i, kind in enumerate(names):
                topic = f"/{kind}"
                connection = writer.add_connection(topic, kind, typestore=store)
                for j in range(2):
                    value = made(store, (Nodetype.NAME, kind))
                    time = 1_500_000_000_000_000_000 + 1000 * i + j
                    writer.write(connection, time, store.serialize_ros1(value, kind))
                    tell(name, topic, time, value)
    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer2(folder / "bag2", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        kind = "sensor_msgs/msg/LaserScan"
        connection = writer.add_connection("/scan", kind, typestore=store)
        for i in range(5):
            value = made(store, (Nodetype.NAME, kind))
            writer.write(connection, 10 + i, store.serialize_cdr(value, kind))
            tell("bag2", "/scan", 10 + i, value)
    with Writer2(folder / "sqlite", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        writer.add_connection("/scan", kind, typestore=store)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
