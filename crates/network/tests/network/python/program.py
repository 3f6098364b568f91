"""A program of Zenoh that knows nothing of Slate but the book: reads, sets and is read by an agent."""

import json
import struct
import sys
import time

import zenoh

port, agent = sys.argv[1:]
config = zenoh.Config()
config.insert_json5("mode", '"peer"')
config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
config.insert_json5("scouting/multicast/enabled", "false")


def reply(session, key, **options):
    """The one reply to a query, and whether it is an answer."""
    (only,) = session.get(key, timeout=5.0, **options)
    content = only.ok if only.ok is not None else only.err
    return only.ok is not None, content


with zenoh.open(config) as session:
    deadline = time.monotonic() + 20
    while not list(session.liveliness().get(f"slate/{agent}/@alive", timeout=1.0)):
        assert time.monotonic() < deadline, "no agent"

    # A value as it changes: CDR behind a header of four bytes, and its stamp.
    subscriber = session.declare_subscriber(f"slate/{agent}/sensor/pose")
    sample = subscriber.recv()
    pose = struct.unpack("<4xddd", bytes(sample.payload))
    layout, sequence, stamp, generation, schema, number = struct.unpack("<BQQQQQ", bytes(sample.attachment))
    assert pose == (1.5, -2.5, 0.25), pose
    assert layout == 1 and sequence > 0 and stamp > 0 and generation == 1
    assert str(sample.encoding) == "application/cdr;slate_msgs/msg/Pose2", sample.encoding
    assert number > 0
    subscriber.undeclare()

    # Its own options: the newest value twice a second.
    key = f"slate/{agent}/@read/rate=500ms/sensor/count"
    subscriber = session.declare_subscriber(key)
    is_ok, newest = reply(session, key)
    assert is_ok, newest.payload.to_string()
    samples = [subscriber.recv() for _ in range(3)]
    numbers = [struct.unpack("<BQQQQQ", bytes(sample.attachment)) for sample in samples]
    assert [entry[5] for entry in numbers] == [1, 2, 3], numbers
    assert numbers[2][2] - numbers[1][2] > 250_000_000, numbers
    subscriber.undeclare()

    is_ok, tree = reply(session, f"slate/{agent}/@tree")
    entries = {entry["path"]: entry for entry in json.loads(tree.payload.to_string())}
    assert is_ok and entries["sensor/pose"]["schema"] == f"{schema:016x}"

    is_ok, newest = reply(session, f"slate/{agent}/sensor/pose/theta")
    assert is_ok and json.loads(newest.payload.to_string()) == 0.25

    # Text, JSON and CDR set a property, and what does not fit says why.
    for key, payload, encoding in [
        ("sensor/params/step", "2.5", zenoh.Encoding.TEXT_PLAIN),
        ("@set/driver/goal", '{"x": 4}', zenoh.Encoding.APPLICATION_JSON),
        ("driver/goal", struct.pack("<4Bddd", 0, 1, 0, 0, 7, 0, 0), zenoh.Encoding.APPLICATION_CDR),
        ("sensor/params/step", "1.5", None),
    ]:
        is_ok, answer = reply(session, f"slate/{agent}/{key}", payload=payload, encoding=encoding)
        assert is_ok, answer.payload.to_string()
        assert json.loads(answer.payload.to_string())["status"] == "accepted"
    is_ok, answer = reply(session, f"slate/{agent}/sensor/params/step", payload="7.5")
    assert not is_ok and "outside" in json.loads(answer.payload.to_string())["reason"]

    # The agent reads what this program writes, until it has seen it.
    publisher = session.declare_publisher("demo/temperature")
    while True:
        publisher.put("21.5", encoding=zenoh.Encoding.TEXT_PLAIN)
        _, seen = reply(session, f"slate/{agent}/driver/seen/value")
        if json.loads(seen.payload.to_string()) == 28.5:
            break
        assert time.monotonic() < deadline, "the agent does not read"
        time.sleep(0.05)
print("done")
