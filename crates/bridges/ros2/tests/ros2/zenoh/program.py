"""A program that speaks the wire of rmw_zenoh and does what a test tells it: a line of JSON for each command, and one for its result.

Arguments: router PORT, or node PORT DOMAIN FOLDER, whose folder has the message files of ROS.
"""

import json
import math
import re
import struct
import sys
import threading
import time

import numpy
import zenoh
import zenoh.ext


def plain(value):
    if hasattr(value, "__dataclass_fields__"):
        return {name: plain(getattr(value, name)) for name in value.__dataclass_fields__ if not name.startswith("__")}
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, (str, int, float, bool)):
        return value
    if len(value) > 10_000:
        # Its length and its sum.
        return [len(value), int(numpy.sum(value, dtype=numpy.uint64))]
    return [plain(item.item() if hasattr(item, "item") else item) for item in value]


class Node:
    def __init__(self, port, domain, folder):
        import zenoh_ros2_sdk as sdk

        self.sdk, self.port, self.domain = sdk, port, domain
        sdk.get_registry(folder)
        self.session = sdk.ZenohSession.get_instance("127.0.0.1", port)
        self.lock = threading.Lock()
        self.publishers, self.heard, self.clients, self.requests, self.kept = {}, {}, {}, {}, []
        self.attachments = {}

    def place(self):
        return {"router_ip": "127.0.0.1", "router_port": self.port, "domain_id": self.domain}

    def quality(self, options):
        qos = self.sdk.qos
        return qos.QosProfile(
            reliability=qos.QosReliability.RELIABLE if options.get("reliable", True) else qos.QosReliability.BEST_EFFORT,
            durability=qos.QosDurability.TRANSIENT_LOCAL if options.get("transient_local") else qos.QosDurability.VOLATILE,
            history_depth=options.get("depth", 10),
        )

    def advertise(self, topic, type, qos={}, node="peer", hash=None):
        more = {"type_hash": hash} if hash else {}
        self.publishers[topic] = self.sdk.ROS2Publisher(topic, type, node_name=node, qos=self.quality(qos), **self.place(), **more)

    def publish(self, topic, value):
        publisher = self.publishers[topic]
        publisher.publish(**build(self.session.store, publisher.msg_type, value))

    def keep(self, topic, type, values):
        """Publishes messages that are kept for late subscriptions, as rmw_zenoh's publishers keep them."""
        self.advertise(topic, type, {"transient_local": True})
        own = self.publishers[topic]
        cache, detection = zenoh.ext.CacheConfig(max_samples=10), zenoh.ext.MissDetectionConfig(heartbeat=None)
        publisher = zenoh.ext.declare_advanced_publisher(
            self.session.session, own.keyexpr, cache=cache, publisher_detection=True, sample_miss_detection=detection
        )
        self.kept.append(publisher)
        for number, value in enumerate(values, 1):
            message = own.msg_class(**build(self.session.store, type, value))
            data = bytes(self.session.store.serialize_cdr(message, type))
            publisher.put(data, attachment=own._create_attachment(number, time.time_ns()))

    def burst(self, topic, count, period):
        """Publishes speeds 1, 2, ... at a rate."""
        publisher, due = self.publishers[topic], time.monotonic()
        for number in range(1, count + 1):
            publisher.publish(**build(self.session.store, publisher.msg_type, {"linear": {"x": float(number)}}))
            due += period
            time.sleep(max(0.0, due - time.monotonic()))

    def show(self, topic, size):
        """Publishes an image of so many bytes, and so many rows of a KiB."""
        data = numpy.arange(size, dtype=numpy.uint64) % 251
        image = {"width": 1024, "height": size // 1024, "step": 1024, "encoding": "mono8", "data": data.astype(numpy.uint8)}
        self.publish(topic, image)

    def subscribe(self, topic, type, qos={}, node="peer"):
        def hear(message):
            with self.lock:
                self.heard.setdefault(topic, []).append(plain(message))

        own = self.sdk.ROS2Subscriber(topic, type, hear, node_name=node, qos=self.quality(qos), **self.place())
        self.kept.append(own)

        # What lies beside each message, which the library leaves out.
        def look(sample):
            with self.lock:
                self.attachments.setdefault(topic, []).append(sample.attachment.to_bytes().hex() if sample.attachment else None)

        self.kept.append(self.session.session.declare_subscriber(own.keyexpr, look))

    def take(self, topic):
        with self.lock:
            return self.heard.pop(topic, [])

    def take_attachments(self, topic):
        with self.lock:
            return self.attachments.pop(topic, [])

    def call(self, service, type, request={}):
        """Response to a request; nothing when none comes."""
        client = self.clients.get(service)
        if client is None:
            client = self.clients[service] = self.sdk.ROS2ServiceClient(service, type, **self.definitions(type), **self.place())
            client.timeout = 10.0
        return plain(client.call(**build(self.session.store, client.request_store_type, request)))

    def definitions(self, type):
        """Both parts of a service, with whole names of the messages in them: the library looks for those of the package elsewhere."""
        package = type.split("/")[0]

        def whole(found):
            self.sdk.load_message_type(f"{package}/msg/{found[1]}")
            return f"{package}/msg/{found[1]}{found[2]}"

        text = self.sdk.get_registry().get_srv_file_path(type).read_text()
        parts = [re.sub(r"^([A-Z]\w+)((?:\[.*\])?\s)", whole, part, flags=re.M).strip() for part in text.split("---\n", 1)]
        return {"request_definition": parts[0] or None, "response_definition": parts[1] or None}

    def serve(self, service, type, response):
        """Offers a service that answers always the same, and notes what was asked."""

        def answer(request):
            with self.lock:
                self.requests.setdefault(service, []).append(plain(request))
            return server.response_msg_class(**build(self.session.store, server.response_store_type, response))

        server = self.sdk.ROS2ServiceServer(service, type, answer, node_name="peer", **self.definitions(type), **self.place())
        self.kept.append(server)

    def asked(self, service):
        with self.lock:
            return self.requests.pop(service, [])

    def pursue(self, action, folder, order):
        """Sends a goal of Fibonacci by keys, bytes and the hashes that ROS computed; whether it was accepted, its state, the numbers and how often there was feedback."""
        with open(f"{folder}/test_msgs/action/Fibonacci.json") as file:
            hashes = {own["type_name"]: own["hash_string"] for own in json.load(file)["type_hashes"]}
        session, goal, heard = self.session.session, bytes(range(16)), []

        def key(name, part):
            kind = f"Fibonacci_{part}"
            return f"{self.domain}{action}/_action/{name}/test_msgs::action::dds_::{kind}_/{hashes['test_msgs/action/' + kind]}"

        def ask(name, part, body):
            attachment = struct.pack("<qqB", 1, time.time_ns(), 16) + bytes(16)
            replies = session.get(
                key(name, part), payload=b"\0\1\0\0" + body, attachment=attachment, timeout=20.0, target=zenoh.QueryTarget.ALL_COMPLETE
            )
            (reply,) = [own.ok for own in replies if own.ok]
            assert reply.attachment.to_bytes()[16:] == bytes([16]) + bytes(16)
            return reply.payload.to_bytes()[4:]

        feedback = session.declare_subscriber(key("feedback", "FeedbackMessage"), lambda own: heard.append(own.payload.to_bytes()[4:20]))
        accepted = ask("send_goal", "SendGoal", goal + struct.pack("<i", order))[0]
        if not accepted:
            return [False, 0, [], 0]
        result = ask("get_result", "GetResult", goal)
        (count,) = struct.unpack_from("<I", result, 4)
        feedback.undeclare()
        return [True, result[0], list(struct.unpack_from(f"<{count}i", result, 8)), sum(own == goal for own in heard)]

    def topics(self):
        return {name: kinds for name, kinds in self.sdk.get_topic_names_and_types(**self.place())}

    def services(self):
        return {name: kinds for name, kinds in self.sdk.get_service_names_and_types(**self.place())}

    def endpoints(self, topic, publishers):
        info = self.sdk.get_topic_info(topic, verbose=True, **self.place())
        found = (info.publishers if publishers else info.subscribers) if info else []
        return [[own.node_name, own.node_namespace, own.topic_type, own.type_hash, own.qos] for own in found]

    def tokens(self):
        """Liveliness tokens of the domain."""
        replies = self.session.session.liveliness().get(f"@ros2_lv/{self.domain}/**", timeout=1.0)
        return sorted(str(reply.ok.key_expr) for reply in replies if reply.ok)

    def gid(self, token):
        """Identity of an endpoint, as rmw_zenoh hashes its token."""
        import xxhash

        number = xxhash.xxh3_128_intdigest(token.encode())
        return number.to_bytes(16, "little").hex()

    def announce(self, token):
        self.kept.append(self.session.session.liveliness().declare_token(token))

    def put(self, key, data):
        self.session.session.put(key, bytes.fromhex(data))


def build(store, kind, values):
    """Arguments of a message whose other fields are zero."""
    fields = store.get_msgdef(kind).fields
    return {name: make(store, of, values.get(name)) for name, of in fields}


def make(store, of, value):
    from rosbags.interfaces import Nodetype

    node, rest = of
    if node == Nodetype.BASE:
        if value is not None:
            return value
        return "" if rest[0] in ("string", "wstring") else False if rest[0] == "bool" else 0.0 if "float" in rest[0] else 0
    if node == Nodetype.NAME:
        return store.types[rest](**build(store, rest, value or {}))
    item, count = rest
    if item[0] == Nodetype.BASE and item[1][0] not in ("string", "wstring"):
        zeros = [0] * (count if node == Nodetype.ARRAY else 0)
        return numpy.array(zeros if value is None else value, dtype=item[1][0])
    return [make(store, item, own) for own in value or []]


def router(port):
    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("listen/endpoints", f'["tcp/127.0.0.1:{port}"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


if sys.argv[1] == "router":
    session = router(int(sys.argv[2]))
    print("listening", flush=True)
    sys.stdin.read()
    session.close()
else:
    node = Node(int(sys.argv[2]), int(sys.argv[3]), sys.argv[4])
    print("listening", flush=True)
    for line in sys.stdin:
        command = json.loads(line)
        result = getattr(node, command.pop("do"))(**command)
        print(json.dumps(result), flush=True)
