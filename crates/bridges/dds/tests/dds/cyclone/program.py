"""A program of CycloneDDS that does what a test tells it: a line of JSON for each command, and one for its result."""

import json
import sys
import time
from dataclasses import dataclass, fields, is_dataclass

import cyclonedds.idl.annotations as annotate
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlEnum, IdlStruct
from cyclonedds.idl.types import array, bounded_str, float32, float64, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.sub import DataReader, Subscriber
from cyclonedds.topic import Topic
from cyclonedds.util import duration


class Mode(IdlEnum, typename="demo::Mode", default="IDLE"):
    IDLE = 0
    DRIVE = 1
    STOP = 7


@dataclass
@annotate.final
class Point(IdlStruct, typename="demo::Point"):
    x: float64
    y: float64


@dataclass
@annotate.final
class Target(IdlStruct, typename="demo::Target"):
    id: int32
    annotate.key("id")
    mode: Mode
    valid: bool
    position: Point
    name: bounded_str[15]
    weights: sequence[float32, 8]
    path: sequence[Point]
    corner: array[float64, 2]


@dataclass
@annotate.final
class Unkeyed(IdlStruct, typename="demo::Target"):
    id: int32
    mode: Mode
    valid: bool
    position: Point
    name: bounded_str[15]
    weights: sequence[float32, 8]
    path: sequence[Point]
    corner: array[float64, 2]


@dataclass
@annotate.appendable
class GrowingPoint(IdlStruct, typename="demo::GrowingPoint"):
    x: float64
    y: float64


@dataclass
@annotate.appendable
class GrowingTarget(IdlStruct, typename="demo::GrowingTarget"):
    id: int32
    annotate.key("id")
    mode: Mode
    valid: bool
    position: GrowingPoint
    name: bounded_str[15]
    weights: sequence[float32, 8]
    path: sequence[GrowingPoint]
    corner: array[float64, 2]
    remark: str


@dataclass
@annotate.appendable
class OldTarget(IdlStruct, typename="demo::GrowingTarget"):
    """An older version, without what was appended."""

    id: int32
    annotate.key("id")
    mode: Mode
    valid: bool
    position: GrowingPoint
    name: bounded_str[15]
    weights: sequence[float32, 8]
    path: sequence[GrowingPoint]
    corner: array[float64, 2]


@dataclass
@annotate.final
class Count(IdlStruct, typename="demo::Count"):
    value: float64


POINTS = {Target: Point, Unkeyed: Point, GrowingTarget: GrowingPoint, OldTarget: GrowingPoint}


def fill(kind, value):
    if kind is Count:
        return Count(**value)
    point = POINTS[kind]
    made = dict(value, mode=Mode(value["mode"]), position=point(**value["position"]), path=[point(**own) for own in value["path"]])
    return kind(**made)


def plain(value):
    if is_dataclass(value):
        return {own.name: plain(getattr(value, own.name)) for own in fields(value)}
    if isinstance(value, Mode):
        return value.value
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value


def quality(options):
    policies = [
        Policy.Reliability.Reliable(duration(seconds=1)) if options.get("reliable", True) else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if options.get("transient_local") else Policy.Durability.Volatile,
        Policy.History.KeepLast(options.get("depth", 10)),
    ]
    if "representation" in options:
        second = options["representation"] == "xcdr2"
        policies.append(Policy.DataRepresentation(use_cdrv0_representation=not second, use_xcdrv2_representation=second))
    return Qos(*policies)


class Peer:
    def __init__(self, domain):
        self.participant = DomainParticipant(domain)
        self.publisher, self.subscriber = Publisher(self.participant), Subscriber(self.participant)
        self.writers, self.readers = {}, {}

    def advertise(self, topic, type, qos={}):
        kind = globals()[type]
        made = Topic(self.participant, topic, kind)
        self.writers[topic] = kind, DataWriter(self.publisher, made, qos=quality(qos))

    def publish(self, topic, value):
        kind, writer = self.writers[topic]
        writer.write(fill(kind, value))

    def dispose(self, topic, value):
        kind, writer = self.writers[topic]
        writer.dispose(fill(kind, value))

    def burst(self, topic, count, period):
        """Publishes numbers 1, 2, ... at a rate."""
        _, writer = self.writers[topic]
        due = time.monotonic()
        for number in range(1, count + 1):
            writer.write(Count(value=float(number)))
            due += period
            time.sleep(max(0.0, due - time.monotonic()))

    def subscribe(self, topic, type, qos={}):
        made = Topic(self.participant, topic, globals()[type])
        self.readers[topic] = DataReader(self.subscriber, made, qos=quality(qos))

    def take(self, topic):
        return [plain(sample) for sample in self.readers[topic].take(N=100) if is_dataclass(sample)]

    def matched(self, topic):
        found = self.writers.get(topic)
        if found:
            return len(found[1].get_matched_subscriptions())
        return len(self.readers[topic].get_matched_publications())

    def about(self):
        return "cyclonedds"


peer = Peer(int(sys.argv[1]))
for line in sys.stdin:
    command = json.loads(line)
    result = getattr(peer, command.pop("do"))(**command)
    print(json.dumps(result), flush=True)
