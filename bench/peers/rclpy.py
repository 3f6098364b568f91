"""A message of ROS 2 from one process to another in Python, one at a time: `rclpy.py reader`, `rclpy.py writer SIZE COUNT`. The
reader prints the nanoseconds that each took."""

import array
import struct
import sys
import time

# The folder of this file holds no packages, and would hide the one of the same name.
sys.path.pop(0)
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import QoSProfile
from std_msgs.msg import Empty, UInt8MultiArray


def now():
    return time.clock_gettime_ns(time.CLOCK_MONOTONIC)


def read(node):
    got = node.create_publisher(Empty, "got", 10)

    def take(message):
        took = now()
        print(took - struct.unpack_from("<Q", message.data)[0], flush=True)
        got.publish(Empty())

    node.create_subscription(UInt8MultiArray, "value", take, QoSProfile(depth=10))
    rclpy.spin(node)


def write(node, size, count):
    answers = [0]

    def answered(_):
        answers[0] += 1

    values = node.create_publisher(UInt8MultiArray, "value", QoSProfile(depth=10))
    node.create_subscription(Empty, "got", answered, 10)
    end = time.monotonic() + 20
    while values.get_subscription_count() == 0 or node.count_publishers("got") == 0:
        if time.monotonic() > end:
            sys.exit("the reader is not found")
        rclpy.spin_once(node, timeout_sec=0.01)
    time.sleep(0.3)
    message = UInt8MultiArray(data=array.array("B", bytes([7]) * size))
    for number in range(count):
        time.sleep(0.0005)
        struct.pack_into("<Q", message.data, 0, now())
        values.publish(message)
        end = time.monotonic() + 10
        while answers[0] <= number:
            if time.monotonic() > end:
                sys.exit("the reader does not answer")
            rclpy.spin_once(node, timeout_sec=0.1)


rclpy.init()
try:
    if sys.argv[1] == "reader":
        read(rclpy.create_node("reader"))
    else:
        write(rclpy.create_node("writer"), int(sys.argv[2]), int(sys.argv[3]))
except ExternalShutdownException:
    pass
