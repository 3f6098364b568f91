"""Programs of CycloneDDS that write and read transforms, as ROS's broadcasters and listeners do."""

import json
import sys
import time
from dataclasses import dataclass, fields

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.sub import DataReader, Subscriber
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


RELIABLE = Policy.Reliability.Reliable(duration(seconds=1))
MOVING = Qos(RELIABLE, Policy.Durability.Volatile, Policy.History.KeepLast(100))
FIXED = Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepLast(1))
HEARD = Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepLast(100))


def stamped(parent, child, x, y):
    now = time.time_ns()
    header = Header(Time(now // 10**9, now % 10**9), parent)
    turn = Quaternion(0.0, 0.0, 0.6, 0.8)
    return TransformStamped(header, child, Transform(Vector3(x, y, 0.5), turn))


def plain(value):
    if isinstance(value, IdlStruct):
        return {own.name: plain(getattr(value, own.name)) for own in fields(value)}
    return [plain(item) for item in value] if isinstance(value, (list, tuple)) else value


class Peer:
    def __init__(self):
        self.participant = DomainParticipant(int(sys.argv[1]))
        self.writers, self.readers = {}, {}

    def topic(self, name):
        return Topic(self.participant, "rt" + name, TFMessage)

    def publish(self, name, transforms):
        """Publishes transforms, each as parent, child, x and y."""
        qos = FIXED if name == "/tf_static" else MOVING
        if name not in self.writers:
            self.writers[name] = DataWriter(Publisher(self.participant), self.topic(name), qos=qos)
        self.writers[name].write(TFMessage([stamped(*own) for own in transforms]))

    def subscribe(self, name):
        qos = HEARD if name == "/tf_static" else MOVING
        self.readers[name] = DataReader(Subscriber(self.participant), self.topic(name), qos=qos)

    def take(self, name):
        return [plain(message) for message in self.readers[name].take(100)]

    def about(self):
        return "cyclonedds"


peer = Peer()
for line in sys.stdin:
    command = json.loads(line)
    print(json.dumps(getattr(peer, command.pop("do"))(**command)), flush=True)
