"""A node of ROS 1 that carries out commands, a JSON object a line, and answers each with a line."""

import importlib
import json
import sys
import threading
import xmlrpc.client

import genpy
import rosgraph
import rospy
from geometry_msgs.msg import TransformStamped


def message_class(name, folder="msg"):
    package, short = name.split("/")
    return getattr(importlib.import_module(f"{package}.{folder}"), short)


def tree(value):
    if isinstance(value, genpy.Message):
        return {name: tree(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, genpy.TVal):
        return {"secs": value.secs, "nsecs": value.nsecs}
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, (list, tuple)):
        return [tree(item) for item in value]
    if isinstance(value, float) and value in (float("inf"), float("-inf")):
        return str(value)
    return value


def fill(message, value):
    """Sets the fields that are named; the others stay as they are."""
    for name, own in value.items():
        if isinstance(own, dict):
            fill(getattr(message, name), own)
        elif isinstance(own, list) and own and isinstance(own[0], dict):
            setattr(message, name, [fill(TransformStamped(), item) for item in own])
        else:
            setattr(message, name, own)
    return message


class Node:
    def __init__(self, name):
        rospy.init_node(name, disable_signals=True)
        self.publishers = {}
        self.heard = {}
        self.servers = {}
        self.requests = []
        self.response = None
        self.lock = threading.Lock()

    def about(self, _):
        return "rospy"

    def advertise(self, command):
        own = message_class(command["type"])
        latched = command.get("latched", False)
        self.publishers[command["topic"]] = rospy.Publisher(command["topic"], own, queue_size=100, latch=latched)

    def publish(self, command):
        publisher = self.publishers[command["topic"]]
        message = publisher.data_class()
        fill(message, command["value"])
        publisher.publish(message)

    def subscribe(self, command):
        topic = command["topic"]
        own = message_class(command["type"]) if "type" in command else rospy.AnyMsg
        self.heard[topic] = []

        def hear(message):
            header = message._connection_header
            value = tree(message) if "type" in command else {"type": header["type"], "checksum": header["md5sum"]}
            with self.lock:
                self.heard[topic].append(value)

        rospy.Subscriber(topic, own, hear, queue_size=1000)

    def take(self, command):
        with self.lock:
            heard, self.heard[command["topic"]] = self.heard[command["topic"]], []
        return heard

    def matched(self, command):
        return self.publishers[command["topic"]].get_num_connections()

    def call(self, command):
        own = message_class(command["type"], "srv")
        try:
            rospy.wait_for_service(command["service"], 10)
            request = fill(own._request_class(), command["request"])
            return tree(rospy.ServiceProxy(command["service"], own)(request))
        except (rospy.ServiceException, rospy.ROSException) as error:
            return {"error": str(error)}

    def call_often(self, command):
        own = message_class(command["type"], "srv")
        proxy = rospy.ServiceProxy(command["service"], own, persistent=True)
        return [proxy(request).success for request in command["requests"]]

    def serve(self, command):
        """Answers all requests with one response; without it, fails."""
        own = message_class(command["type"], "srv")
        self.response = command["response"]

        def answer(request):
            self.requests.append(tree(request))
            return self.response and fill(own._response_class(), self.response)

        if command["service"] not in self.servers:
            self.servers[command["service"]] = rospy.Service(command["service"], own, answer)

    def asked(self, _):
        return self.requests

    def topics(self, _):
        return dict(rospy.get_published_topics())

    def ports(self, command):
        """Ports of a node: that of its API, and that of one of its topics."""
        _, _, api = rosgraph.Master("/test").handle.lookupNode("/test", command["node"])
        topic = xmlrpc.client.ServerProxy(api).requestTopic("/test", command["topic"], [["TCPROS"]])
        return [int(api.rstrip("/").rsplit(":", 1)[1]), topic[2][2]]

    def register(self, command):
        """Says to the master that another node publishes a topic."""
        rosgraph.Master("/far").registerPublisher(command["topic"], command["type"], command["api"])

    def nodes(self, _):
        publishers, subscribers, _ = rosgraph.Master("/test").getSystemState()
        return sorted({node for _, nodes in publishers + subscribers for node in nodes})


def main():
    node = Node(sys.argv[1])
    for line in sys.stdin:
        command = json.loads(line)
        print(json.dumps(getattr(node, command["do"])(command)), flush=True)


if __name__ == "__main__":
    main()
