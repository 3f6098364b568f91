"""A robot as ROS 2 nodes know it: a base that drives by /cmd_vel, with a laser, a positioning system and a compass.

It is simulated here: a disc among the walls of a room, with a pillar in it. `python3 base.py`, with ROS 2's rclpy.
EXP1 and the robot of examples/mapping drive it.
"""

import math

import rclpy
from geometry_msgs.msg import Point, Quaternion, Twist
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

PERIOD = 0.02  # s
COMMAND_TIMEOUT = 0.5  # s without a command, after which it stops
BEAMS = 180
MOUNT = 0.12  # m, of the laser ahead of the axle
MAX_RANGE = 4.0  # m
RADIUS = 0.2  # m, of the disc
WALL = 2.5  # m from the middle of the room
PILLAR = (-0.6, 0.5, 0.2)  # x, y and radius, m
START = (0.6, 0.8, 0.0)


class Base(Node):
    def __init__(self):
        super().__init__("base")
        self.x, self.y, self.theta = START
        self.linear = self.angular = 0.0
        self.age = COMMAND_TIMEOUT
        self.scan = self.create_publisher(LaserScan, "/scan", qos_profile_sensor_data)
        self.position = self.create_publisher(Point, "/position", 10)
        self.orientation = self.create_publisher(Quaternion, "/orientation", 10)
        self.odometry = self.create_publisher(Odometry, "/odom", 10)
        self.create_subscription(Twist, "/cmd_vel", self.command, 10)
        self.create_timer(PERIOD, self.step)

    def command(self, twist):
        self.linear, self.angular, self.age = twist.linear.x, twist.angular.z, 0.0

    def step(self):
        self.age += PERIOD
        if self.age > COMMAND_TIMEOUT:
            self.linear = self.angular = 0.0
        self.theta += self.angular * PERIOD
        x = self.x + self.linear * math.cos(self.theta) * PERIOD
        y = self.y + self.linear * math.sin(self.theta) * PERIOD
        if is_free(x, y):
            self.x, self.y = x, y
        turn = Quaternion(z=math.sin(self.theta / 2), w=math.cos(self.theta / 2))
        self.position.publish(Point(x=self.x, y=self.y))
        self.orientation.publish(turn)
        self.publish_odometry()
        self.publish_scan()

    def publish_odometry(self):
        """Where it is from where it began."""
        x, y, theta = self.x - START[0], self.y - START[1], self.theta - START[2]
        odometry = Odometry(child_frame_id="base_link")
        odometry.header.frame_id = "odom"
        odometry.header.stamp = self.get_clock().now().to_msg()
        cosine, sine = math.cos(START[2]), math.sin(START[2])
        odometry.pose.pose.position = Point(x=cosine * x + sine * y, y=cosine * y - sine * x)
        odometry.pose.pose.orientation = Quaternion(z=math.sin(theta / 2), w=math.cos(theta / 2))
        odometry.twist.twist.linear.x, odometry.twist.twist.angular.z = self.linear, self.angular
        self.odometry.publish(odometry)

    def publish_scan(self):
        step = 2 * math.pi / BEAMS
        scan = LaserScan(angle_min=-math.pi + step / 2, angle_increment=step, range_min=0.05, range_max=MAX_RANGE)
        scan.angle_max = scan.angle_min + (BEAMS - 1) * step
        scan.header.frame_id = "laser"
        scan.header.stamp = self.get_clock().now().to_msg()
        x, y = self.x + MOUNT * math.cos(self.theta), self.y + MOUNT * math.sin(self.theta)
        scan.ranges = [distance(x, y, self.theta + scan.angle_min + beam * step) for beam in range(BEAMS)]
        self.scan.publish(scan)


def is_free(x, y):
    """Whether the robot touches nothing there."""
    in_room = max(abs(x), abs(y)) < WALL - RADIUS
    return in_room and math.hypot(x - PILLAR[0], y - PILLAR[1]) > PILLAR[2] + RADIUS


def distance(x, y, angle):
    """Distance to what is nearest in a direction; infinite beyond the range of the laser."""
    cosine, sine = math.cos(angle), math.sin(angle)
    walls = [(math.copysign(WALL, way) - at) / way for at, way in ((x, cosine), (y, sine)) if abs(way) > 1e-9]
    nearest = min(walls)
    x, y = PILLAR[0] - x, PILLAR[1] - y
    along, aside = x * cosine + y * sine, x * sine - y * cosine
    if along > 0 and abs(aside) < PILLAR[2]:
        nearest = min(nearest, along - math.sqrt(PILLAR[2] ** 2 - aside**2))
    return float(nearest) if nearest < MAX_RANGE else math.inf


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(Base())
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
