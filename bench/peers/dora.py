"""A message of dora from one process to another, one at a time: `dora.py reader FILE`, `dora.py writer SIZE COUNT`, as its
daemon starts them. The reader writes the nanoseconds that each took into the file. `dora.py idle FILE` does nothing when it is
called, and writes a line when that was for the first time."""

import struct
import sys
import time

# The folder of this file holds no packages, and would hide the one of the same name.
sys.path.pop(0)
import pyarrow
from dora import Node


def now():
    return time.clock_gettime_ns(time.CLOCK_MONOTONIC)


def read(node, file):
    with open(file, "w") as times:
        while (event := node.next()) is not None:
            if event["type"] != "INPUT":
                if event["type"] == "STOP":
                    break
                continue
            took = now()
            sent = struct.unpack_from("<Q", event["value"].buffers()[1], event["value"].offset)[0]
            times.write(f"{took - sent}\n")
            times.flush()
            # So that the memory goes back.
            del event
            node.send_output("got", pyarrow.array([1], type=pyarrow.uint8()))


def write(node, size, count):
    bytes_ = bytearray([7]) * size
    for _ in range(count):
        time.sleep(0.0005)
        struct.pack_into("<Q", bytes_, 0, now())
        node.send_output("value", pyarrow.Array.from_buffers(pyarrow.uint8(), size, [None, pyarrow.py_buffer(bytes_)]))
        while (event := node.next(timeout=10)) is not None and event["type"] != "INPUT":
            if event["type"] in ("ERROR", "STOP"):
                sys.exit(f"the reader does not answer: {event}")


def idle(node, file):
    with open(file, "w") as called:
        calls = 0
        while (event := node.next()) is not None and event["type"] != "STOP":
            if event["type"] == "INPUT":
                calls += 1
                if calls == 1:
                    called.write("called\n")
                    called.flush()


if sys.argv[1] == "reader":
    read(Node(), sys.argv[2])
elif sys.argv[1] == "idle":
    idle(Node(), sys.argv[2])
else:
    write(Node(), int(sys.argv[2]), int(sys.argv[3]))
