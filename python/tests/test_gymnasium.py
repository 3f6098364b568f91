"""Environments of Gymnasium: their interface, and the same bytes as the command."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
import warnings
from pathlib import Path

import gymnasium
import numpy
from gymnasium.utils.env_checker import check_env

import slate
import slate.environments

VELOCITY = "robots.r2.modules.policy.inputs.velocity"
NAMES = ("slate/Exp1-v0", "slate/Navigation-v0")


def setUpModule():
    folder = tempfile.TemporaryDirectory()
    unittest.addModuleCleanup(folder.cleanup)
    before = os.getcwd()
    os.chdir(folder.name)
    unittest.addModuleCleanup(os.chdir, before)


def episode(environment, policy, seed, steps=10_000):
    """Drives until the end; the info of the last step, and the sum of rewards."""
    observation, _ = environment.reset(seed=seed)
    total = 0.0
    for _ in range(steps):
        observation, reward, terminated, truncated, info = environment.step(policy(observation))
        total += reward
        if terminated or truncated:
            break
    return info, total


class Environments(unittest.TestCase):
    def test_the_checker_finds_nothing(self):
        for name in NAMES:
            with self.subTest(name), warnings.catch_warnings():
                warnings.simplefilter("error")
                # Bounds of goals and velocities are infinite on purpose, and nothing is rendered.
                warnings.filterwarnings("ignore", message=".*(infinity|render).*")
                environment = gymnasium.make(name)
                check_env(environment.unwrapped)
                environment.close()

    def test_an_environment_has_the_digest_of_the_command(self):
        # The same velocity in each cycle: 0.3 m/s and 0.2 rad/s.
        action = numpy.array([0.5, 0.1], dtype=numpy.float32)
        velocity = {"linear": float(action[0]) * 0.6, "angular": float(action[1]) * 2.0}
        for name, example in zip(NAMES, ("exp1_policy", "navigation_policy")):
            with self.subTest(name):
                settings = {VELOCITY: f"{{ linear = {velocity['linear']!r}, angular = {velocity['angular']!r} }}"}
                settings["modules.referee.params.time_limit"] = 5.0
                environment = gymnasium.make(name, set=settings, ends_at_collision=False)
                info, _ = episode(environment, lambda _: action, seed=3)
                environment.close()
                summary = slate.run(example, seed=3, set=settings, out=example)
                self.assertEqual(info["digest"], summary.digest)
                self.assertEqual(info["figures"]["path_length"], summary.path_length)

    def test_the_command_repeats_an_episode_from_its_recording(self):
        environment = gymnasium.make("slate/Exp1-v0", record="episodes", set={"modules.referee.params.time_limit": 3.0})
        generator = numpy.random.default_rng(1)
        info, _ = episode(environment, lambda _: generator.uniform(-1, 1, 2), seed=5)
        environment.close()
        file = Path("episodes/5.mcap")
        verified = subprocess.run([slate.program(), "replay", "--verify", "--json", file], capture_output=True, text=True, check=False)
        self.assertEqual(json.loads(verified.stdout)["outcome"], "identical", verified.stdout + verified.stderr)
        ends = dict(slate.open_recording(file).info["metadata"])
        self.assertIn(info["digest"], json.dumps(ends))

    def test_the_same_seed_and_actions_give_the_same_steps(self):
        def steps(name):
            environment = gymnasium.make(name)
            environment.action_space.seed(1)
            observation, _ = environment.reset(seed=7)
            made = [observation]
            for _ in range(1000):
                observation, reward, terminated, truncated, _ = environment.step(environment.action_space.sample())
                made.append(numpy.append(observation, (reward, terminated, truncated)))
                if terminated or truncated:
                    made.append(environment.reset()[0])
            environment.close()
            return made

        for name in NAMES:
            with self.subTest(name):
                first, second = steps(name), steps(name)
                self.assertEqual(len(first), len(second))
                for one, other in zip(first, second):
                    numpy.testing.assert_array_equal(one, other)

    def test_a_robot_that_steers_to_the_goal_arrives(self):
        def towards(observation):
            x, y = observation[-4:-2]
            return numpy.array([0.5, numpy.clip(2 * numpy.arctan2(y, x), -1, 1)], dtype=numpy.float32)

        # Without the box and the other robot in its way.
        layout = {"world.layout": "authors", "world.layouts.authors.robots": "{ r1 = { x = -1.5, y = -1.5, theta = 0.0 }, r2 = { x = 1.0, y = 1.0, theta = 0.0 } }"}
        environment = gymnasium.make("slate/Exp1-v0", set=layout)
        info, total = episode(environment, towards, seed=0)
        environment.close()
        self.assertEqual(info["outcome"], "goal_reached")
        self.assertGreater(total, 10.0)

    def test_time_that_is_up_truncates_and_a_collision_terminates(self):
        environment = gymnasium.make("slate/Exp1-v0", set={"modules.referee.params.time_limit": 0.2})
        environment.reset(seed=0)
        ends = [environment.step(numpy.zeros(2))[2:4] for _ in range(10)]
        self.assertIn((False, True), ends)
        environment = gymnasium.make("slate/Exp1-v0")
        info, _ = episode(environment, lambda _: numpy.array([1.0, 0.0]), seed=3)
        self.assertEqual(info["outcome"], "collided")

    def test_several_environments_step_together(self):
        environments = gymnasium.make_vec("slate/Exp1-v0", num_envs=3)
        observations, _ = environments.reset(seed=3)
        alone, _ = gymnasium.make("slate/Exp1-v0").reset(seed=4)
        numpy.testing.assert_array_equal(observations[1], alone)
        observations, rewards, *_ = environments.step(environments.action_space.sample())
        self.assertEqual((observations.shape[0], rewards.shape), (3, (3,)))
        environments.close()

    def test_environments_in_processes_step_together(self):
        environments = gymnasium.make_vec("slate/Exp1-v0", num_envs=2, vectorization_mode="async")
        observations, _ = environments.reset(seed=3)
        environments.step(environments.action_space.sample())
        self.assertEqual(observations.shape[0], 2)
        environments.close()

    def test_a_step_outside_of_an_episode_is_refused(self):
        environment = gymnasium.make("slate/Exp1-v0", set={"modules.referee.params.time_limit": 0.1})
        with self.assertRaisesRegex(gymnasium.error.ResetNeeded, "reset"):
            environment.step(numpy.zeros(2))
        episode(environment, lambda _: numpy.zeros(2), seed=0)
        with self.assertRaisesRegex(gymnasium.error.ResetNeeded, "the episode has ended"):
            environment.step(numpy.zeros(2))
        environment.reset(seed=0)
        environment.step(numpy.zeros(2))
        environment.close()

    def test_an_unsuitable_action_is_refused(self):
        environment = gymnasium.make("slate/Exp1-v0")
        environment.reset(seed=0)
        for action in (numpy.zeros(3), numpy.zeros((2, 1)), 0.5):
            with self.assertRaisesRegex(ValueError, "expected an action of 2 numbers"):
                environment.step(action)
        with self.assertRaisesRegex(ValueError, "finite"):
            environment.step(numpy.array([numpy.nan, 0.0]))
        environment.close()

    def test_an_episode_that_goes_on_pays_for_each_collision(self):
        environment = gymnasium.make("slate/Exp1-v0", ends_at_collision=False)
        environment.reset(seed=3)
        rewards = [environment.step(numpy.array([1.0, 0.0]))[1] for _ in range(400)]
        environment.close()
        self.assertLess(min(rewards), -4.9)
        self.assertGreater(rewards[-1], -1.0)

    def test_an_episode_whose_time_is_up_after_a_collision_is_truncated(self):
        settings = {"modules.referee.params.time_limit": 8.0, "world.goal": "[0.0, 0.0]"}
        environment = gymnasium.make("slate/Exp1-v0", ends_at_collision=False, set=settings)
        environment.reset(seed=3)
        ended, rewards = False, []
        while not ended:
            _, reward, terminated, truncated, _ = environment.step(numpy.array([1.0, 0.0]))
            rewards.append(reward)
            ended = terminated or truncated
        environment.close()
        self.assertLess(min(rewards), -4.9)
        self.assertEqual((terminated, truncated), (False, True))
        self.assertLess(max(rewards), 1.0)

    def test_a_missing_package_is_named(self):
        import importlib

        with unittest.mock.patch.dict(sys.modules, gymnasium=None), self.assertRaisesRegex(ImportError, "pip install"):
            importlib.reload(slate.environments)


if __name__ == "__main__":
    unittest.main()
