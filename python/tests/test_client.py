"""Agents from Python: values, messages, links, settings, motion, recordings."""

import asyncio
import contextlib
import io
import math
import os
import pickle
import re
import signal
import tempfile
import threading
import time
import tomllib
import unittest
import unittest.mock
from pathlib import Path

import slate
from slate._slate import agent_of
from slate.settings import setting


def setUpModule():
    # Agents of others are not in this folder.
    folder = tempfile.TemporaryDirectory()
    unittest.addModuleCleanup(folder.cleanup)
    unittest.enterModuleContext(unittest.mock.patch.dict(os.environ, XDG_RUNTIME_DIR=folder.name))


class Client(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.old = os.getcwd()
        os.chdir(cls.folder.name)
        # A mission that never ends, however slow the machine is.
        endless = {"modules.referee.params.goal_tolerance": 0.0}
        cls.running = slate.start("exp1", seed=0, set=endless, out=f"{cls.folder.name}/out")
        cls.agent = cls.running.__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.running.__exit__(None, None, None)
        os.chdir(cls.old)
        cls.folder.cleanup()

    def test_a_value_is_read_with_its_stamp(self):
        pose = self.agent["/simulator/r2/truth"].wait(timeout=5)
        self.assertEqual(set(pose.value), {"x", "y", "theta"})
        self.assertGreater(pose.sequence, 0)
        self.assertGreater(pose.time, 0.0)
        x = self.agent["simulator/r2/truth"] / "x"
        self.assertIsInstance(x.value, float)
        self.assertIn("/simulator/r2/truth/x = ", repr(x))

    def test_values_are_watched_in_order(self):
        samples = []
        for sample in self.agent["/simulator/r2/truth"].watch(timeout=5):
            samples.append(sample)
            if len(samples) == 5:
                break
        numbers = [sample.sequence for sample in samples]
        self.assertEqual(numbers, sorted(set(numbers)))
        for before, after in zip(samples, samples[1:]):
            self.assertEqual(after.missed, after.sequence - before.sequence - 1)

    def test_several_properties_are_watched_at_once(self):
        urls = ["/simulator/r2/truth", "/simulator/r1/truth"]
        seen = set()
        for url, _ in self.agent.watch(*urls, timeout=5):
            seen.add(url)
            if len(seen) == 2:
                break
        self.assertEqual(seen, set(urls))

    def test_a_property_is_awaited_with_asyncio(self):
        async def first(url):
            async for sample in self.agent[url]:
                return sample.sequence

        async def both():
            return await asyncio.gather(first("/simulator/r2/truth"), first("/simulator/r1/truth"))

        self.assertTrue(all(number > 0 for number in asyncio.run(both())))

    def test_lists_are_arrays_of_numpy(self):
        numpy = self._numpy()
        echoes = self.agent["/r2/sonar/value/echoes"].array()
        self.assertEqual(echoes["range"].dtype, numpy.float64)
        self.assertGreater(echoes.size, 1)
        with self.assertRaisesRegex(TypeError, "found dict: name one of its fields"):
            self.agent["/simulator/r2/truth"].array()

    def test_a_parameter_is_set_and_reverted(self):
        speed = self.agent["/r2/planner/params/max_linear_velocity"]
        before = speed.value
        speed.value = 0.3
        self.assertEqual(speed.value, 0.3)
        self.agent.revert()
        self.assertEqual(speed.value, before)

    def test_a_refusal_has_its_code_and_help(self):
        with self.assertRaises(slate.Refused) as caught:
            self.agent["/r2/planner/params/max_linear_velocity"].set(99)
        self.assertEqual(caught.exception.code, "S015")
        with self.assertRaises(slate.Refused) as caught:
            _ = self.agent["/r2/planer"].value
        self.assertEqual(caught.exception.code, "S004")
        self.assertTrue(caught.exception.help)

    def test_links_are_listed_and_changed(self):
        links = {link["to"]: link["from"] for link in self.agent.links()}
        self.assertIn("r2/planner/goal", {to.lstrip("/") for to in links})

    def test_modules_are_switched_off_and_on(self):
        state = self.agent["/referee/state/condition"]
        for switch, off in ((self.agent.disable, True), (self.agent.enable, False)):
            switch("referee")
            state.wait(lambda condition: (condition == "INACTIVE") == off, timeout=5)

    def test_a_stop_holds_until_reset_and_arm(self):
        self.agent.stop("a test")
        self.assertTrue(self.agent.reset())
        self.assertFalse(self.agent.reset())
        self.agent.arm()

    def test_a_lease_drives_while_its_block_lasts(self):
        with self.agent.drive("r2/wheels", who="a test") as lease:
            lease.command({"left": 1.0, "right": 1.0})
            self.agent["/r2/wheels/gate"].wait(lambda gate: gate["priority"] not in ("PLAN", "REFLEX"), timeout=5)
            holder = self.agent.call("GET", "/leases")[0]["holder"]
            self.assertIn("a test", holder)
        self.assertIsNone(self.agent.call("GET", "/leases")[0]["holder"])

    def test_a_recording_has_what_was_selected(self):
        with self.agent.record("part.mcap", "/simulator/**") as file:
            self.agent["/simulator/r2/truth"].wait(timeout=5)
        self.assertGreater(file.stat().st_size, 0)

    def test_a_snapshot_is_saved_and_resumed(self):
        self.agent.snapshot("here.snapshot")
        self.assertGreater(Path("here.snapshot").stat().st_size, 0)
        self.agent.resume("here.snapshot")

    def test_an_agent_that_is_not_there_is_named(self):
        with self.assertRaisesRegex(slate.NoAgent, "no agent `nobody` runs here; running: "):
            slate.connect("nobody")

    def test_threads_share_an_agent(self):
        reads = []

        def read():
            for _ in range(50):
                reads.append(self.agent["/simulator/r2/truth"].value)

        threads = [threading.Thread(target=read) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(reads), 200)

    def test_a_signal_interrupts_a_wait(self):
        # Programs in the background of a shell ignore it.
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        self.addCleanup(signal.signal, signal.SIGINT, before)
        timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        begin = time.monotonic()
        with self.assertRaises(KeyboardInterrupt):
            self.agent["/simulator/r2/truth"].wait(lambda pose: pose["x"] > 1e9, timeout=30)
        self.assertLess(time.monotonic() - begin, 10)
        self.assertIsNotNone(self.agent["/simulator/r2/truth"].value)

    def test_a_wait_without_a_value_ends(self):
        with self.assertRaises(TimeoutError):
            self.agent["/simulator/r2/truth"].wait(lambda pose: pose["x"] > 1e9, timeout=0.3)

    def test_a_wait_times_out_although_values_come_fast(self):
        with slate.start("exp1", set={"modules.referee.params.goal_tolerance": 0.0}, rate="max") as agent:
            begin = time.monotonic()
            with self.assertRaises(TimeoutError):
                agent["/simulator/r2/truth"].wait(lambda pose: False, timeout=0.5)
            self.assertLess(time.monotonic() - begin, 10)

    def test_a_lease_outlasts_a_pause_and_hides_no_error(self):
        with self.agent.drive("r2/wheels", who="a test") as lease:
            # Longer than a lease that nobody renews.
            time.sleep(6)
            lease.command({"left": 1.0, "right": 1.0}, seconds=0.5)
        with self.assertRaises(ZeroDivisionError), self.agent.drive("r2/wheels") as lease:
            lease.release()
            1 / 0

    def test_no_connection_crosses_a_fork(self):
        child = os.fork()
        if child == 0:
            try:
                _ = self.agent["/simulator/r2/truth"].value
            except slate.AgentError as error:
                os._exit(0 if "fork" in str(error) else 1)
            os._exit(2)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0)

    def _numpy(self):
        try:
            import numpy
        except ImportError:
            self.skipTest("numpy is not installed")
        return numpy


class Program(unittest.TestCase):
    def test_a_run_returns_its_summary(self):
        with tempfile.TemporaryDirectory() as out:
            first, second = (slate.run("exp1", seed=0, out=f"{out}/{run}") for run in "ab")
        self.assertEqual(first["digest"], second["digest"])

    def test_settings_are_written_as_toml(self):
        written = {"a": 1, "b": [0.5, True], "c d": {"e": 'a "quote"\x7f', "f": math.inf}}
        self.assertEqual(tomllib.loads(f"x = {setting(written)}")["x"], written)
        self.assertEqual(setting("10 Hz"), "10 Hz")
        with self.assertRaises(TypeError):
            setting([None])

    def test_a_run_that_can_not_begin_says_why(self):
        with self.assertRaises(slate.ProgramError) as caught:
            slate.run("exp0")
        self.assertIn("exp0", caught.exception.output)
        # As processes of a pool hand it on.
        copy = pickle.loads(pickle.dumps(caught.exception))
        self.assertEqual((str(copy), copy.status, copy.output), (str(caught.exception), caught.exception.status, caught.exception.output))

    def test_a_batch_returns_its_statistics(self):
        with tempfile.TemporaryDirectory() as out:
            table = slate.batch("exp1", runs=2, out=out)
        self.assertEqual(table.attrs["statistics"]["runs"], 2)

    def test_nothing_runs_after_the_block(self):
        with slate.start("exp1", seed=0) as agent:
            name = agent.name
        self.assertNotIn(name, slate.agents())

    def test_an_agent_that_dies_in_the_block_says_what_it_said_last(self):
        with self.assertRaises(slate.AgentUnreachable) as caught, slate.start("exp1", seed=0) as agent:
            children = (Path("/proc/self/task") / str(threading.get_native_id()) / "children").read_text()
            process = next(child for child in map(int, children.split()) if agent_of(child) == agent.name)
            os.kill(process, signal.SIGKILL)
            while True:
                _ = agent["/simulator/r2/truth"].value
        self.assertIn("exit code -9", caught.exception.__notes__[0])

    def test_the_example_of_the_package_runs(self):
        text = (Path(__file__).parents[1] / "README.md").read_text()
        (example,) = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            exec(example, {})
        self.assertIn("theta", printed.getvalue())


if __name__ == "__main__":
    unittest.main()
