"""Runs from Python: by the program, and in this process."""

import os
import signal
import sys
import tempfile
import threading
import time
import unittest
import unittest.mock
from pathlib import Path

import slate

#: A mission that never ends.
ENDLESS = {"modules.referee.params.goal_tolerance": 0.0, "modules.referee.params.time_limit": 1e9}


def setUpModule():
    folder = tempfile.TemporaryDirectory()
    unittest.addModuleCleanup(folder.cleanup)
    unittest.enterModuleContext(unittest.mock.patch.dict(os.environ, XDG_RUNTIME_DIR=folder.name))
    before = os.getcwd()
    os.chdir(folder.name)
    unittest.addModuleCleanup(os.chdir, before)


def interrupted_after(case, seconds, call):
    """Time that a call takes until Ctrl-C ends it, s."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    case.addCleanup(signal.signal, signal.SIGINT, before)
    timer = threading.Timer(seconds, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    begin = time.monotonic()
    with case.assertRaises(KeyboardInterrupt):
        call()
    return time.monotonic() - begin


class Run(unittest.TestCase):
    def test_a_run_returns_outcome_digest_and_files(self):
        result = slate.run("exp1", seed=3, out="run", record=True)
        self.assertTrue(result.succeeded)
        self.assertEqual(result.outcome, "goal_reached")
        self.assertEqual(result.digest, result["digest"])
        self.assertGreater(result.path_length, 1.0)
        self.assertGreater(result.time_to_goal, 1.0)
        self.assertEqual(result.report, Path("run"))
        self.assertTrue(result.recording.is_file())
        self.assertIn(result.digest, repr(result))

    def test_settings_change_a_run(self):
        result = slate.run("exp1", seed=3, set={"modules.referee.params.time_limit": 1.0}, out="short")
        self.assertEqual(result.outcome, "timed_out")
        self.assertFalse(result.succeeded)
        self.assertLess(result["sim_time_s"], 1.1)

    def test_a_run_is_ended_by_a_signal(self):
        taken = interrupted_after(self, 1.0, lambda: slate.run("exp1", set=ENDLESS, out="endless"))
        self.assertLess(taken, 15)

    def test_a_batch_is_a_data_frame(self):
        import pandas

        table = slate.batch("exp1", runs=2, seed=3)
        self.assertIsInstance(table, pandas.DataFrame)
        self.assertEqual(list(table["seed"]), [3, 4])
        self.assertEqual(table["digest"][0], slate.run("exp1", seed=3, out="third").digest)
        self.assertEqual(table.attrs["statistics"]["runs"], 2)
        self.assertIn("figures.lasting_route_changes", table.columns)

    def test_a_batch_is_columns_without_pandas(self):
        with unittest.mock.patch.dict(sys.modules, pandas=None):
            table = slate.batch("exp1", runs=2, seed=3, out="batch")
        self.assertEqual(table["seed"], [3, 4])
        self.assertEqual(table.attrs["statistics"]["runs"], 2)
        self.assertTrue(Path("batch/batch.json").is_file())


class Simulation(unittest.TestCase):
    def test_a_simulation_has_the_digest_of_the_command(self):
        with slate.Simulation("exp1", seed=3) as simulation:
            result = simulation.run()
        summary = slate.run("exp1", seed=3, out="same")
        self.assertEqual(result["digest"], summary.digest)
        self.assertEqual(result["cycles"], summary["ticks"])
        self.assertEqual(result["outcome"], summary.outcome)
        self.assertEqual(result["figures"]["path_length"], summary.path_length)

    def test_values_are_read_between_cycles(self):
        with slate.Simulation("exp1", seed=3) as simulation:
            pose = simulation["/simulator/r2/truth"]
            self.assertIsNone(pose.value)
            self.assertTrue(simulation.step(5))
            self.assertEqual(simulation.cycle, 5)
            sample = pose.read()
            self.assertEqual(sample.sequence, 5)
            self.assertEqual(sample.time, simulation.time)
            self.assertEqual((pose / "x").value, sample.value["x"])
            self.assertEqual(simulation.properties()["/simulator/r2/truth"], "Pose2")
            self.assertIn("/simulator/r2/truth", list(simulation))

    def test_parameters_are_set_and_commands_are_not(self):
        with slate.Simulation("exp1", seed=3) as simulation:
            simulation.step()
            speed = simulation["/r2/planner/params/max_linear_velocity"]
            speed.value = 0.25
            simulation.step()
            self.assertEqual(speed.value, 0.25)
            simulation.set({"robots.r2.modules.planner.params.max_linear_velocity": 0.3})
            simulation.step()
            self.assertEqual(speed.value, 0.3)
            with self.assertRaises(slate.Refused) as caught:
                simulation["/simulator/r2/truth"].value = {"x": 0.0}
            self.assertTrue(caught.exception.help)
            with self.assertRaisesRegex(KeyError, "planer"):
                _ = simulation["/r2/planer"].value

    def test_arrays_are_those_of_the_property(self):
        import numpy

        with slate.Simulation("exp1", seed=3) as simulation:
            simulation.step()
            echoes = simulation["/r2/sonar/value/echoes"].array()
            ranges = simulation["/r2/sonar/value/echoes/*/range"].array()
            self.assertEqual(ranges.dtype, numpy.float64)
            self.assertEqual(list(echoes["range"]), list(ranges))
            probe = simulation.probe("/simulator/r2/truth/x", ("/r2/sonar/value/echoes/*/range", 4))
            numbers = numpy.empty(probe.length)
            simulation.sample(probe, numbers)
            self.assertEqual(numbers[0], simulation["/simulator/r2/truth/x"].value)
            self.assertEqual(list(numbers[1:]), list(ranges.reshape(4, -1).min(axis=1)))

    def test_an_image_and_a_map_are_arrays(self):
        with slate.Simulation("rescue_camera") as simulation:
            simulation.step(20)
            url = next(url for url, interface in simulation.properties().items() if interface == "Image")
            image = simulation[url].array()
            self.assertEqual(image.shape[:2], (simulation[f"{url}/height"].value, simulation[f"{url}/width"].value))
        with slate.Simulation("mapping") as simulation:
            simulation.step(50)
            grids = [url for url, interface in simulation.properties().items() if interface == "OccupancyGrid"]
            cells = next(array for array in (simulation[url].array() for url in grids) if array.size)
            self.assertEqual(cells.ndim, 2)
            self.assertGreaterEqual(cells.min(), -1)

    def test_what_can_not_run_says_why_with_help(self):
        with self.assertRaises(slate.ConfigurationError) as caught:
            slate.Simulation("exp0")
        self.assertIn("exp1", caught.exception.help)
        with self.assertRaises(slate.ConfigurationError) as caught:
            slate.Simulation("exp1", set={"robots.r2.modules.planer.enabled": False})
        self.assertIn("planer", caught.exception.report)

    def test_long_steps_end_by_a_signal_and_leave_the_interpreter_free(self):
        with slate.Simulation("exp1", set=ENDLESS) as simulation:
            counted, over = [0], threading.Event()

            def count():
                while not over.is_set():
                    counted[0] += 1
                    time.sleep(0.001)

            thread = threading.Thread(target=count)
            thread.start()
            try:
                taken = interrupted_after(self, 0.5, lambda: simulation.step(1 << 40))
            finally:
                over.set()
                thread.join()
            self.assertLess(taken, 10)
            self.assertGreater(counted[0], 20)
            cycle = simulation.cycle
            simulation.step()
            self.assertEqual(simulation.cycle, cycle + 1)

    def test_a_step_after_the_end_is_refused(self):
        with slate.Simulation("exp1", seed=3, set={"modules.referee.params.time_limit": 0.1}) as simulation:
            self.assertEqual(simulation.run()["outcome"], "timed_out")
            with self.assertRaisesRegex(RuntimeError, "the mission ended in cycle"):
                simulation.step()

    def test_a_closed_simulation_says_so(self):
        simulation = slate.Simulation("exp1")
        simulation.close()
        with self.assertRaisesRegex(ValueError, "closed"):
            simulation.step()


if __name__ == "__main__":
    unittest.main()
