"""Drives a robot with two wheels to a target.

`python3 -m unittest` tests it without a robot, `slate run PROJECT_NAME.toml` runs it in the simulator.
"""

import math

import slate


class Follower(slate.Module, stage="Act", name="MODULE_KIND"):
    """Turns to the target and drives there."""

    # Ports; the configuration links them.
    position = slate.Required("Position", stale_after="200ms", doc="Position of the robot.")
    orientation = slate.Required("Orientation", stale_after="200ms", doc="Heading of the robot.")
    target = slate.Required("Point2", doc="Target position.")
    wheels = slate.Command("WheelSpeeds", doc="Command for the wheels.")

    max_linear_velocity = slate.Parameter(0.4, range=(0.0, 1.2), unit="m/s", doc="maximum linear velocity")
    gain = slate.Parameter(
        2.0, range=(0.0, 10.0), unit="1/s", doc="linear velocity per meter of distance to the target"
    )
    goal_tolerance = slate.Parameter(
        0.05, range=(0.0, 1.0), unit="m", doc="distance from the target that counts as reached"
    )
    wheel_radius = slate.Parameter(0.0975, range=(0.01, 1.0), unit="m", doc="radius of a wheel")
    track = slate.Parameter(0.331, range=(0.01, 2.0), unit="m", doc="distance between the wheels")

    # State between two ticks, which a snapshot has and a reload of the code keeps.
    arrivals: int = 0

    def tick(self, now):
        position, orientation = self.position.fresh(), self.orientation.fresh()
        if position is None or orientation is None:
            # Without a pose it commands nothing, and the gate stops the wheels.
            return slate.Outcome.DEGRADED
        x, y = self.target.x - position.x, self.target.y - position.y
        distance = math.hypot(x, y)
        if distance < self.goal_tolerance:
            if self.arrivals == 0:
                now.info("arrived", distance=distance)
            self.arrivals += 1
            self.wheels.send(left=0.0, right=0.0)
            return None
        error = math.remainder(math.atan2(y, x) - orientation.theta, math.tau)
        # Slower while it faces away from the target, and near it.
        speed = min(self.max_linear_velocity, self.gain * distance) * max(math.cos(error), 0.0)
        turn = self.gain * error * self.track / 2.0
        self.wheels.send(left=(speed - turn) / self.wheel_radius, right=(speed + turn) / self.wheel_radius)
        return None
