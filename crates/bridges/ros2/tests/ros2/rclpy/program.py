"""A node of ROS 2 that does what a test tells it: a line of JSON for each command, and one for its result."""

import array
import json
import math
import random
import sys
import threading
import time

import rclpy
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.utilities import get_rmw_implementation_identifier


def load(name):
    package, part, kind = name.split("/")
    return getattr(__import__(f"{package}.{part}", fromlist=[kind]), kind)


def fill(message, values):
    for name, value in values.items():
        own = getattr(message, name)
        if isinstance(value, dict):
            fill(own, value)
        else:
            setattr(message, name, value)
    return message


def plain(value):
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, (str, int, float, bool)):
        return value
    return [plain(item) for item in value]


def quality(options):
    return QoSProfile(
        depth=options.get("depth", 10),
        reliability=ReliabilityPolicy.RELIABLE if options.get("reliable", True) else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if options.get("transient_local") else DurabilityPolicy.VOLATILE,
    )


class Peer:
    def __init__(self, name):
        self.node = rclpy.create_node(name)
        self.publishers, self.heard, self.incompatible = {}, {}, []
        self.lock = threading.Lock()
        self.clients, self.requests = {}, {}
        self.goals, self.feedback = [], []

    def note(self, topic, event):
        with self.lock:
            self.incompatible.append([topic, str(event.last_policy_kind)])

    def advertise(self, topic, type, qos={}):
        events = PublisherEventCallbacks(incompatible_qos=lambda event: self.note(topic, event))
        self.publishers[topic] = self.node.create_publisher(load(type), topic, quality(qos), event_callbacks=events)

    def publish(self, topic, value):
        publisher = self.publishers[topic]
        publisher.publish(fill(publisher.msg_type(), value))

    def burst(self, topic, count, period):
        """Publishes speeds 1, 2, ... at a rate."""
        publisher = self.publishers[topic]
        message, due = publisher.msg_type(), time.monotonic()
        for number in range(1, count + 1):
            message.linear.x = float(number)
            publisher.publish(message)
            due += period
            time.sleep(max(0.0, due - time.monotonic()))

    def show(self, topic, size):
        """Publishes an image of so many bytes, and so many rows of a KiB."""
        image = fill(self.publishers[topic].msg_type(), {"width": 1024, "height": size // 1024, "step": 1024, "encoding": "mono8"})
        image.data = array.array("B", (bytes(range(251)) * (size // 251 + 1))[:size])
        self.publishers[topic].publish(image)

    def see(self, topic):
        """Subscribes to images; what is heard of them are height, size and checksum."""

        def hear(image):
            with self.lock:
                self.heard.setdefault(topic, []).append([image.height, len(image.data), sum(image.data)])

        self.node.create_subscription(load("sensor_msgs/msg/Image"), topic, hear, quality({"depth": 1}))

    def matched(self, topic):
        return self.publishers[topic].get_subscription_count()

    def subscribe(self, topic, type, qos={}):
        def hear(message):
            with self.lock:
                self.heard.setdefault(topic, []).append(plain(message))

        events = SubscriptionEventCallbacks(incompatible_qos=lambda event: self.note(topic, event))
        self.node.create_subscription(load(type), topic, hear, quality(qos), event_callbacks=events)

    def call(self, service, type, request={}, timeout=20.0):
        """Response to a request; nothing when none comes."""
        client = self.clients.get(service)
        if client is None:
            client = self.clients[service] = self.node.create_client(load(type), service)
        if not client.wait_for_service(timeout):
            return None
        done = threading.Event()
        future = client.call_async(fill(load(type).Request(), request))
        future.add_done_callback(lambda _: done.set())
        return plain(future.result()) if done.wait(timeout) else None

    def serve(self, service, type, response):
        """Offers a service that answers always the same, and notes what was asked."""

        def answer(request, answered):
            with self.lock:
                self.requests.setdefault(service, []).append(plain(request))
            return fill(answered, response)

        self.node.create_service(load(type), service, answer)

    def asked(self, service):
        with self.lock:
            return self.requests.pop(service, [])

    def wait_for(self, future):
        """Result of a future; nothing when none comes."""
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        return future.result() if done.wait(20.0) else None

    def send_goal(self, action, type, goal):
        """Number of a goal that was accepted; nothing if it was rejected."""
        client = self.clients.get(action)
        if client is None:
            client = self.clients[action] = ActionClient(self.node, load(type), action)
        if not client.wait_for_server(20.0):
            return "no server"
        number = len(self.goals)
        self.feedback.append([])
        note = lambda message: self.feedback[number].append(plain(message.feedback))
        handle = self.wait_for(client.send_goal_async(fill(load(type).Goal(), goal), feedback_callback=note))
        self.goals.append(handle)
        return number if handle.accepted else None

    def goal_state(self, number):
        return self.goals[number].status

    def goal_result(self, number):
        """State and result of a goal, and the feedback that came before."""
        response = self.wait_for(self.goals[number].get_result_async())
        return [response.status, plain(response.result), self.feedback[number]]

    def cancel_goal(self, number):
        """Code of the response, and how many goals are being cancelled."""
        response = self.wait_for(self.goals[number].cancel_goal_async())
        return [response.return_code, len(response.goals_canceling)]

    def offer_fibonacci(self, action, type):
        """Counts as long as it is told, 20 ms a number; rejects negative orders and aborts those above 40."""
        kind = load(type)

        def count(goal):
            message = kind.Feedback(sequence=[0, 1])
            if goal.request.order > 40:
                goal.abort()
                return kind.Result()
            while len(message.sequence) <= goal.request.order:
                if goal.is_cancel_requested:
                    goal.canceled()
                    return kind.Result(sequence=message.sequence)
                message.sequence.append(message.sequence[-1] + message.sequence[-2])
                goal.publish_feedback(message)
                time.sleep(0.02)
            goal.succeed()
            return kind.Result(sequence=message.sequence)

        node = rclpy.create_node(self.node.get_name() + "_actions")
        self.server = ActionServer(
            node,
            kind,
            action,
            count,
            goal_callback=lambda goal: GoalResponse.REJECT if goal.order < 0 else GoalResponse.ACCEPT,
            cancel_callback=lambda goal: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )
        executor = MultiThreadedExecutor(4)
        executor.add_node(node)
        threading.Thread(target=executor.spin, daemon=True).start()

    def parameters(self, node, what, arguments):
        """What rclpy's client of parameters gets."""
        client = self.clients.get(node)
        if client is None:
            client = self.clients[node] = AsyncParameterClient(self.node, node)
        if not client.wait_for_services(20.0):
            return "the services are not there"
        calls = {
            "list": client.list_parameters,
            "get": client.get_parameters,
            "types": client.get_parameter_types,
            "describe": client.describe_parameters,
            "set": client.set_parameters,
            "set_atomically": client.set_parameters_atomically,
        }
        if isinstance(arguments, dict):
            arguments = [Parameter(name, value=value) for name, value in arguments.items()]
        done = threading.Event()
        future = calls[what](arguments)
        future.add_done_callback(lambda _: done.set())
        if not done.wait(20.0):
            return "no answer"
        result = future.result()
        if what == "list":
            return sorted(result.result.names)
        if what == "get":
            return [parameter_value_to_python(value) for value in result.values]
        if what == "types":
            return list(result.types)
        if what == "describe":
            return plain(result.descriptors)
        if what == "set":
            return [[own.successful, own.reason] for own in result.results]
        return [result.result.successful, result.result.reason]

    def steer(self, source, to, pause=0.0, limit=None):
        """Steers by each odometry with one twist, and thinks for up to `pause` seconds; no more than `limit` times."""
        commands = self.node.create_publisher(load("geometry_msgs/msg/Twist"), to, quality({}))
        count = 0

        def answer(odometry):
            nonlocal count
            count += 1
            if limit is not None and count > limit:
                return
            time.sleep(random.random() * pause)
            command = commands.msg_type()
            command.linear.x = 0.5 * (10.0 - odometry.pose.pose.position.x)
            command.angular.z = float(count)
            commands.publish(command)

        self.node.create_subscription(load("nav_msgs/msg/Odometry"), source, answer, quality({}))

    def pace(self, to, period):
        """Publishes its time by a timer, in a node that follows the clock."""
        self.follow_clock()
        commands = self.node.create_publisher(load("geometry_msgs/msg/Twist"), to, quality({}))

        def publish():
            command = commands.msg_type()
            command.linear.x = self.now() / 1e9
            commands.publish(command)

        self.node.create_timer(period, publish)

    def join(self, count):
        """Joins with so many participants at once, each a node with a publisher and a subscription."""
        self.members, ready = [], threading.Barrier(count)

        def member(number):
            context = rclpy.Context()
            ready.wait()
            context.init()
            node = rclpy.create_node(f"member_{number}", context=context)
            publisher = node.create_publisher(load("geometry_msgs/msg/Twist"), "/cmd_vel", 10)
            node.create_subscription(load("nav_msgs/msg/Odometry"), "/odom", lambda odometry: None, 10)
            with self.lock:
                self.members.append((node, publisher))

        threads = [threading.Thread(target=member, args=[number]) for number in range(count)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    def members_that_see(self, name, agents):
        """How many members see a node, and the subscriptions of commands and publishers of odometry of so many."""
        return sum(
            name in node.get_node_names()
            and publisher.get_subscription_count() == agents
            and node.count_publishers("/odom") == agents
            for node, publisher in self.members
        )

    def follow_clock(self):
        self.node.set_parameters([Parameter("use_sim_time", value=True)])

    def now(self):
        """The node's time, nanoseconds."""
        return self.node.get_clock().now().nanoseconds

    def services(self, name, space="/"):
        return dict(self.node.get_service_names_and_types_by_node(name, space))

    def take(self, topic):
        with self.lock:
            return self.heard.pop(topic, [])

    def take_incompatible(self):
        with self.lock:
            taken, self.incompatible = self.incompatible, []
            return taken

    def nodes(self):
        return [space + name if space == "/" else f"{space}/{name}" for name, space in self.node.get_node_names_and_namespaces()]

    def topics(self):
        return {name: kinds for name, kinds in self.node.get_topic_names_and_types()}

    def endpoints(self, topic, publishers):
        get = self.node.get_publishers_info_by_topic if publishers else self.node.get_subscriptions_info_by_topic
        return [
            [own.node_name, own.topic_type, own.qos_profile.reliability.name, own.qos_profile.durability.name]
            for own in get(topic)
        ]

    def about(self):
        return get_rmw_implementation_identifier()


rclpy.init()
peer = Peer(sys.argv[1])
executor = SingleThreadedExecutor()
executor.add_node(peer.node)
threading.Thread(target=executor.spin, daemon=True).start()
for line in sys.stdin:
    command = json.loads(line)
    result = getattr(peer, command.pop("do"))(**command)
    print(json.dumps(result), flush=True)
