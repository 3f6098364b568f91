"""Writes recordings with the writer of PyPI's mcap, and one of ROS 2 with that of mcap_ros2: ten messages in each."""

import sys
from pathlib import Path

from mcap.writer import CompressionType, IndexType, Writer
from mcap_ros2.writer import Writer as RosWriter

FORMS = {
    "default": {},
    "lz4": {"compression": CompressionType.LZ4},
    "none": {"compression": CompressionType.NONE},
    "loose": {"use_chunking": False},
    "data_crcs": {"enable_data_crcs": True},
    "no_crcs": {"enable_crcs": False},
    "no_indexes": {"index_types": IndexType.NONE},
    "no_offsets": {"use_summary_offsets": False},
    "offsets_alone": {"use_statistics": False, "repeat_channels": False, "repeat_schemas": False, "use_chunking": False},
    "nothing": {
        "use_statistics": False,
        "repeat_channels": False,
        "repeat_schemas": False,
        "use_chunking": False,
        "index_types": IndexType.NONE,
    },
}


def write(path, options, has_extras):
    with open(path, "wb") as file:
        writer = Writer(file, **options)
        writer.start(profile="ros2", library="test")
        if has_extras:
            writer.add_attachment(create_time=1, log_time=2, name="robot.toml", media_type="text/plain", data=b"seed = 3")
            writer.add_metadata("run", {"seed": "3"})
        schema = writer.register_schema("test/Range", "jsonschema", b"{}")
        channel = writer.register_channel("/range", "json", schema)
        for i in range(10):
            data = b'{"range":%d}' % i
            writer.add_message(channel, log_time=i, data=data, publish_time=i, sequence=i)
        writer.finish()


folder = Path(sys.argv[1])
for name, options in FORMS.items():
    for has_extras in (False, True):
        write(folder / f"{name}{'_extras' if has_extras else ''}.mcap", options, has_extras)
with open(folder / "ros2.mcap", "wb") as file:
    writer = RosWriter(file)
    schema = writer.register_msgdef("test/Range", "float64 range\n")
    for i in range(10):
        writer.write_message("/range", schema, {"range": float(i)}, log_time=i, publish_time=i, sequence=i)
    writer.finish()
