"""Environments of Gymnasium: a robot of a simulation that a policy drives. One step is one cycle of 20 ms.

Importing this module registers `slate/Exp1-v0` and `slate/Navigation-v0`.
"""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

try:
    import gymnasium
    import numpy
except ImportError as error:
    raise ImportError("environments need gymnasium: pip install 'slate-robotics[gymnasium]'") from error

from .simulation import Simulation

#: State of a mission in progress, as the interface `MissionState` has it.
_RUNNING = 0.0
#: Outcomes of a mission, as the interface `MissionOutcome` has them.
_COLLIDED = 5.0
_TIMED_OUT = 6.0


class RobotEnvironment(gymnasium.Env):
    """Robot on two wheels that drives to a goal, at the velocity that is the action.

    The action is the linear and the angular velocity, each from -1 to 1 of its maximum. The observation has the ranges
    of a sensor, the goal in the frame of the robot (x, y, m), and the linear and the angular velocity of its odometry.
    The reward is the progress towards the goal, m, less `time_cost` for each step, 10 more at the goal, and 5 less for each
    collision that the robot causes, which ends the episode unless `ends_at_collision` is False.

    `reset(seed=3)` is the world of `slate run NAME --seed 3`, where NAME is `exp1_policy` or `navigation_policy`; `set`
    overrides settings. Each episode is recorded into the folder `record`, as `SEED.mcap`. At the end of an episode the
    info has `outcome`, `figures`, `seed` and `digest`.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}

    configuration: ClassVar[str]
    """Example that is run."""
    ranges: ClassVar[tuple[str, int]]
    """Ranges of the observation: URL and number."""
    maximum_range: ClassVar[float]
    """Range without an obstacle, m."""
    maximum_velocity: ClassVar[tuple[float, float]] = (0.6, 2.0)
    """Linear velocity, m/s, and angular velocity, rad/s, of the action 1."""
    goal: ClassVar[tuple[float, float]]
    """Goal, m, unless `set` has another one."""
    time_cost: ClassVar[float] = 0.002

    def __init__(
        self,
        *,
        set: Mapping[str, Any] | None = None,
        record: str | os.PathLike[str] | None = None,
        ends_at_collision: bool = True,
        render_mode: str | None = None,
    ) -> None:
        if render_mode is not None:
            raise ValueError(f"expected no render_mode, found {render_mode!r}: record an episode, and look at it with `slate report`")
        self.render_mode = None
        self._set = dict(set or {})
        self._record = None if record is None else Path(record)
        self._ends_at_collision = ends_at_collision
        goal = self._set.get("world.goal", self.goal)
        # Settings may be text, as on the command line.
        self._goal = tuple(tomllib.loads(f"goal = {goal}")["goal"] if isinstance(goal, str) else goal)
        self._count = self.ranges[1]
        high = numpy.full(self._count + 4, numpy.inf, dtype=numpy.float32)
        high[: self._count] = self.maximum_range
        low = -high
        low[: self._count] = 0.0
        self.observation_space = gymnasium.spaces.Box(low, high, dtype=numpy.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), dtype=numpy.float32)
        self._simulation: Simulation | None = None
        self._has_ended = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begins an episode in the world of a seed, or of one that is drawn."""
        super().reset(seed=seed)
        self._seed = int(self.np_random.integers(1 << 31)) if seed is None else seed
        self.close()
        record = None
        if self._record is not None:
            record = self._record / f"{self._seed}.mcap"
        simulation = Simulation(self.configuration, seed=self._seed, set=self._set, record=record)
        self._agent = simulation._agent
        # Before the first cycle, so that recordings know what comes from outside.
        self._input = simulation.input("/r2/policy/velocity")
        self._probe = simulation.probe(
            self.ranges,
            "/r2/position/value/x",
            "/r2/position/value/y",
            "/r2/odometry/value/twist/linear",
            "/r2/odometry/value/twist/angular",
            "/r2/orientation/value/theta",
            "/referee/verdict/state",
            "/referee/verdict/outcome",
            "/referee/metrics/collisions_caused",
            "/referee/metrics/time_to_goal",
        )
        # The first cycle has the first measurements; no velocity is set in it.
        simulation.step()
        self._numbers = numpy.empty(self._probe.length)
        self._simulation = simulation
        self._agent.sample(self._probe, self._numbers)
        self._pose = (0.0, 0.0, 0.0)
        self._distance = 0.0
        self._has_ended = False
        observation, _, _, self._collisions, _ = self._observe()
        return observation, {"seed": self._seed}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Drives at a velocity for one cycle."""
        if self._simulation is None:
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        if self._has_ended:
            raise gymnasium.error.ResetNeeded("the episode has ended: call reset() before step()")
        if numpy.shape(action) != (2,):
            raise ValueError(f"expected an action of 2 numbers, linear and angular velocity, found {action!r}")
        linear, angular = action
        if not (math.isfinite(linear) and math.isfinite(angular)):
            raise ValueError(f"expected an action of finite numbers, found {action!r}")
        velocity, turn = self.maximum_velocity
        values = [velocity * max(-1.0, min(1.0, float(linear))), turn * max(-1.0, min(1.0, float(angular)))]
        self._agent.drive(self._input, values, self._probe, self._numbers)
        before = self._distance
        observation, state, outcome, collisions, has_arrived = self._observe()
        caused, self._collisions = max(0.0, collisions - self._collisions), collisions
        reward = before - self._distance - self.time_cost - 5.0 * caused
        terminated = truncated = False
        if state != _RUNNING:
            # With a collision, the outcome of a mission whose time is up is the collision.
            truncated = not has_arrived and outcome in (_TIMED_OUT, _COLLIDED)
            terminated = not truncated
            if has_arrived:
                reward += 10.0
        if caused > 0.0 and self._ends_at_collision:
            terminated, truncated = True, False
        if not (terminated or truncated):
            return observation, reward, False, False, {}
        self._has_ended = True
        return observation, reward, terminated, truncated, self._info()

    def _observe(self) -> tuple[Any, float, float, float, bool]:
        """Observation, state and outcome of the mission, number of collisions caused, and whether the robot has arrived."""
        numbers, count = self._numbers, self._count
        x, y, linear, angular, theta, state, outcome, collisions, arrival = numbers[count:].tolist()
        if x != x or y != y or theta != theta:
            # The positioning system has nothing now.
            x, y, theta = self._pose
        self._pose = (x, y, theta)
        ahead, aside = self._goal[0] - x, self._goal[1] - y
        self._distance = math.hypot(ahead, aside)
        cos, sin = math.cos(theta), math.sin(theta)
        numbers[count] = cos * ahead + sin * aside
        numbers[count + 1] = cos * aside - sin * ahead
        observation = numbers[: count + 4].astype(numpy.float32)
        # A sensor without an echo measures infinity, and one without a value NaN.
        numpy.fmin(observation[:count], self.maximum_range, out=observation[:count])
        return observation, state, outcome, collisions, arrival == arrival

    def _info(self) -> dict[str, Any]:
        result = self._simulation.result
        # The mission goes on after a collision, which ends the episode.
        outcome = result["outcome"] or "collided"
        return {"outcome": outcome, "figures": result["figures"], "seed": self._seed, "digest": self._simulation.digest}

    @property
    def simulation(self) -> Simulation | None:
        """Simulation of the present episode."""
        return self._simulation

    def close(self) -> None:
        """Ends the episode and its recording."""
        if self._simulation is not None:
            self._simulation.close()
            self._simulation = None


class Exp1Environment(RobotEnvironment):
    """RoCS EXP1: a Pioneer P3-DX with sonars drives to the origin, past a box and a robot that wanders."""

    configuration = "exp1_policy"
    ranges = ("/r2/sonar/value/echoes/*/range", 16)
    maximum_range = 1.0
    goal = (0.0, 0.0)


class NavigationEnvironment(RobotEnvironment):
    """Office: a Pioneer P3-DX with a laser scanner drives to a place in the corridor, among people who walk."""

    configuration = "navigation_policy"
    ranges = ("/r2/laser/value/ranges", 36)
    maximum_range = 4.0
    goal = (12.0, 7.0)


for _name, _environment in (("Exp1", Exp1Environment), ("Navigation", NavigationEnvironment)):
    if f"slate/{_name}-v0" not in gymnasium.registry:
        # The checker looks at each step, which costs more than a cycle; `check_env` is there for it.
        gymnasium.register(
            f"slate/{_name}-v0",
            entry_point=f"{__name__}:{_environment.__name__}",
            disable_env_checker=True,
            order_enforce=False,
        )
