"""Writes files as the blackboard logger of Fawkes does: values as a C compiler lays them out."""

import ctypes
import struct
import sys
from pathlib import Path

MEMBERS = {
    "Laser360Interface": [
        ("frame", ctypes.c_char * 32),
        ("distances", ctypes.c_float * 360),
        ("clockwise_angle", ctypes.c_bool),
    ],
    "MotorInterface": [
        *[(name, ctypes.c_uint32) for name in ("motor_state", "drive_mode")],
        *[(name, ctypes.c_int32) for name in ("right_rpm", "rear_rpm", "left_rpm")],
        *[
            (name, ctypes.c_float)
            for name in (
                "odometry_path_length",
                "odometry_position_x",
                "odometry_position_y",
                "odometry_orientation",
                "vx",
                "vy",
                "omega",
                "des_vx",
                "des_vy",
                "des_omega",
            )
        ],
        ("controller", ctypes.c_uint32),
        ("controller_thread_name", ctypes.c_char * 64),
    ],
    "Position3DInterface": [
        ("frame", ctypes.c_char * 32),
        ("visibility_history", ctypes.c_int32),
        ("rotation", ctypes.c_double * 4),
        ("translation", ctypes.c_double * 3),
        ("covariance", ctypes.c_double * 36),
    ],
    "OwnInterface": [("number", ctypes.c_uint32)],
}


def structure(name, pack):
    fields = [("timestamp_sec", ctypes.c_int64), ("timestamp_usec", ctypes.c_int64), *MEMBERS[name]]
    content = {"_fields_": fields}
    if pack:
        content["_pack_"] = pack
    return type(name, (ctypes.LittleEndianStructure,), content)


def swapped(entry):
    """As it lies in the memory of a machine whose big end comes first."""
    content = bytearray(bytes(entry))
    for name, kind in entry._fields_:
        place = getattr(type(entry), name)
        size = ctypes.sizeof(getattr(kind, "_type_", kind)) if issubclass(kind, ctypes.Array) else ctypes.sizeof(kind)
        for at in range(place.offset, place.offset + place.size, size):
            content[at : at + size] = content[at : at + size][::-1]
    return bytes(content)


def write(path, name, identity, values, is_big=False, pack=None, items=None):
    kind = structure(name, pack)
    order = ">" if is_big else "<"
    head = struct.pack(">II", 0xFFBBFFBB, 1)
    head += b"\x80\0\0\0" if is_big else b"\0\0\0\0"
    head += struct.pack(order + "I32s48s64s16sIQQ", len(values) if items is None else items, b"soccer", name.encode(),
                        identity.encode(), bytes(range(16)), ctypes.sizeof(kind), 1_300_000_000, 250_000)
    body = b""
    for i, value in enumerate(values):
        entry = kind(timestamp_sec=1_300_000_000 + i, timestamp_usec=7)
        for field, content in value.items():
            if isinstance(content, list):
                for j, number in enumerate(content):
                    getattr(entry, field)[j] = number
            else:
                setattr(entry, field, content)
        body += struct.pack(order + "II", i, 500_000) + (swapped(entry) if is_big else bytes(entry))
    path.write_bytes(head + body)


def main(folder):
    laser = {"frame": b"laser", "distances": [i / 4 for i in range(360)]}
    lasers = [dict(laser, clockwise_angle=False), dict(laser, clockwise_angle=True)]
    motor = {"odometry_position_x": 1.5, "odometry_position_y": -2.5, "odometry_orientation": 0.25, "vx": 0.5, "vy": 0.75,
             "omega": -0.125, "right_rpm": -7, "controller_thread_name": "Käthe".encode()}
    place = {"frame": b"map", "visibility_history": -3, "rotation": [0.0, 0.0, 0.6, 0.8], "translation": [1.0, 2.0, 3.0]}
    for name, is_big in [("little", False), ("big", True)]:
        write(folder / f"laser-{name}.log", "Laser360Interface", "Laser front", lasers, is_big)
        write(folder / f"motor-{name}.log", "MotorInterface", "Robotino", [motor], is_big)
        for pack in [None, 4]:
            write(folder / f"place-{name}-{pack or 8}.log", "Position3DInterface", "ball", [place], is_big, pack)
    write(folder / "own.log", "OwnInterface", "x", [{"number": 7}])
    write(folder / "counted.log", "MotorInterface", "Robotino", [motor] * 3, items=5)
    write(folder / "uncounted.log", "MotorInterface", "Robotino", [motor] * 3, items=0)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
