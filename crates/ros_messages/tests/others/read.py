"""Prints what each message of an MCAP file holds, as two libraries read it: one JSON object a line."""

import dataclasses
import json
import math
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader


def tree(value):
    """What JSON has for it; for the numbers that JSON has not, their names."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (bytes, list, tuple)):
        return [tree(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if dataclasses.is_dataclass(value):
        # One library adds the name of the message and its constants, and marks names that are keywords of its language.
        names = [field.name for field in dataclasses.fields(value)]
        names = [name for name in names if not name.startswith("__") and (not name.isupper() or len(name) == 1)]
        return {name.rstrip("_"): tree(getattr(value, name)) for name in names}
    if hasattr(value, "__slots__"):
        return {name: tree(getattr(value, name)) for name in value.__slots__}
    return value


def tell(reader, topic, value):
    print(json.dumps({"reader": reader, "topic": topic, "value": tree(value)}))


def main(path):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            tell("mcap", channel.topic, message)

    with AnyReader([path]) as reader:
        for connection, _, data in reader.messages():
            tell("rosbags", connection.topic, reader.deserialize(data, connection.msgtype))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
