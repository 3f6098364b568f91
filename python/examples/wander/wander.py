"""A robot wanders: it drives where its laser sees most room. Run it with `slate run wander.toml`."""

import numpy

import slate


class Wander(slate.Module, stage="Act", deadline="20ms"):
    """Turns to the direction with most room and drives, the slower the nearer the next obstacle is."""

    scan = slate.Required("LaserScan", stale_after="300ms", doc="Scan of the laser.")
    wheels = slate.Command("WheelSpeeds", doc="Command for the wheels.")
    heading = slate.Output("Orientation", doc="Chosen direction, in the robot's frame.")

    max_linear_velocity = slate.Parameter(0.4, range=(0.0, 1.2), unit="m/s", doc="maximum linear velocity")
    stop_distance = slate.Parameter(0.4, range=(0.1, 2.0), unit="m", doc="range of an obstacle at which it stops")
    window = slate.Parameter(61, range=(1, 201), doc="beams over which ranges are averaged")
    wheel_radius = slate.Parameter(0.0975, range=(0.01, 1.0), unit="m", doc="radius of a wheel")
    track = slate.Parameter(0.331, range=(0.01, 2.0), unit="m", doc="distance between the wheels")

    turn: float = 0.0

    def tick(self, now):
        if self.scan.fresh() is None:
            return slate.Outcome.DEGRADED
        # A view of the scan's memory; `minimum` makes the only copy.
        ranges = numpy.minimum(self.scan.ranges, self.scan.range_max)
        angles = self.scan.angle_min + self.scan.angle_increment * numpy.arange(len(ranges))
        room = numpy.convolve(ranges, numpy.full(self.window, 1.0 / self.window), mode="same")
        ahead = numpy.abs(angles) < 0.5
        nearest = float(ranges[ahead].min())
        if nearest < self.stop_distance:
            # It keeps turning to one side until there is room ahead.
            self.turn = self.turn or (1.0 if room[angles > 0.0].sum() > room[angles < 0.0].sum() else -1.0)
            speed, turn = 0.0, self.turn
        else:
            self.turn = 0.0
            best = float(angles[int(numpy.argmax(room))])
            self.heading.set(theta=best)
            speed = self.max_linear_velocity * min(1.0, (nearest - self.stop_distance) / 1.0)
            turn = max(-1.0, min(1.0, best))
        difference = turn * self.track / 2.0
        self.wheels.send(
            left=(speed - difference) / self.wheel_radius, right=(speed + difference) / self.wheel_radius
        )
        return None
