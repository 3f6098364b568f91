"""Prints a message of each type that ROS 2 brings: its definition, its bytes in both byte orders, and what it holds."""

import itertools
import json

import numpy
from read import tree
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

store = get_typestore(Stores.ROS2_JAZZY)
numbers = itertools.cycle(range(1, 100))


def made(description):
    """Another value each time."""
    kind, inside = description
    if kind == Nodetype.NAME:
        fields = store.fielddefs[inside][1]
        return store.types[inside](**{name: made(field) for name, field in fields})
    if kind == Nodetype.BASE:
        name, number = inside[0], next(numbers)
        if name == "string":
            return "ä" * (number % 5)
        if name == "bool":
            return number % 2 == 0
        return number + 0.5 if name.startswith("float") else number
    item, size = inside
    items = [made(item) for _ in range(size if kind == Nodetype.ARRAY else next(numbers) % 4)]
    if item[0] == Nodetype.BASE and item[1][0] != "string":
        name = item[1][0]
        return numpy.array(items, dtype="uint8" if name in ("byte", "char", "octet") else name)
    return items


def shown(value):
    """Without what messages without fields have instead."""
    if isinstance(value, list):
        return [shown(item) for item in value]
    if isinstance(value, dict):
        return {
            name: shown(item) for name, item in value.items() if name != "structure_needs_at_least_one_member"
        }
    return value


for name in sorted(store.fielddefs):
    message = made((Nodetype.NAME, name))
    print(
        json.dumps(
            {
                "name": name,
                "text": store.generate_msgdef(name, ros_version=2)[0],
                "messages": [list(bytes(store.serialize_cdr(message, name, little_endian=little))) for little in (True, False)],
                "value": shown(tree(message)),
            }
        )
    )
