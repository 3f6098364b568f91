"""Modules in Python: in a fixture, in agents, with faults, across reloads and snapshots."""

import json
import os
import subprocess
import sys
import tempfile
import time
import unittest
import unittest.mock
from pathlib import Path

import numpy
import slate
from slate.program import program

MODULES = '''
import os, signal, sys, time
import slate

VERSION = 1.0


class Counter(slate.Module, stage="Think"):
    """Counts its ticks."""

    count = slate.Output("Point2", doc="Count, and the version of the code.")
    step = slate.Parameter(1.0, range=(0.0, 10.0), doc="addition in each tick")
    total: float = 0.0

    def tick(self, now):
        self.total += self.step
        self.count.set(x=self.total, y=VERSION)


class Villain(slate.Module, stage="Think"):
    """Does what it is told."""

    order = slate.Inbox("Point2")
    alive = slate.Output("Point2", safe={"x": -1.0, "y": 0.0})
    ticks: int = 0

    def tick(self, now):
        self.ticks += 1
        self.alive.set(x=self.ticks, y=0.0)
        for order in self.order:
            deed = [None, self.mistake, sys.exit, self.loop, lambda: os._exit(3), self.die][int(order.x)]
            deed()

    def mistake(self):
        return {}["no such key"]

    def loop(self):
        while True:
            pass

    def die(self):
        os.kill(os.getpid(), signal.SIGKILL)
'''

CONFIGURATION = '''
[agent]
name = "modules"

[loop]
period = "20ms"
hang = "1s"

[plugins.odd]
file = "odd.py"

[modules.counter]
[modules.villain]
'''


class Beams(slate.Module, stage="SensorProcess"):
    """Copies a laser scan."""

    scan = slate.Input("LaserScan")
    sonar = slate.Input("SonarScan")
    copy = slate.Output("LaserScan", capacity=8)
    motion = slate.Output("Twist2")
    seen: list = []
    history: object = numpy.zeros(2)
    _kept: object = None

    def create(self, setup):
        self._kept = {}

    def tick(self, now):
        if self._kept.get("deed"):
            return self._kept["deed"](self)
        scan = self.scan.get()
        if scan is None:
            return slate.Outcome.DEGRADED
        copy = self.copy.write(len(scan.ranges))
        copy.angle_min = scan.angle_min
        copy.ranges[:] = scan.ranges
        self.seen = self.seen + [float(scan.ranges.sum())]
        return None


SCAN = {"angle_min": -1.0, "angle_increment": 0.5, "range_min": 0.1, "range_max": 9.0, "ranges": [1.0, 2.0, 3.5]}


def seconds(limit, condition):
    """Waits for a condition, and returns its value."""
    until = time.monotonic() + limit
    while time.monotonic() < until:
        if value := condition():
            return value
        time.sleep(0.02)
    raise AssertionError(f"not within {limit} s")


class InFixture(unittest.TestCase):
    def beams(self, deed=None):
        beams = slate.Fixture(Beams)
        beams.module._kept["deed"] = deed
        beams.set("scan", SCAN)
        return beams

    def refusal(self, deed, error=TypeError):
        with self.assertRaises(error) as raised:
            self.beams(deed).tick()
        return str(raised.exception)

    def test_arrays_are_views_of_inputs_and_outputs(self):
        views = []

        def deed(beams):
            ranges = beams.scan.get().ranges
            views.append((ranges.dtype, ranges.flags.owndata, ranges.flags.writeable, ranges.copy()))
            with self.assertRaises(ValueError):
                ranges[0] = 5.0
            again = beams.scan.get().ranges
            self.assertTrue(numpy.shares_memory(ranges, again))
            out = beams.copy.write(2)
            out.ranges[:] = [7.0, 8.0]
            self.assertTrue(out.ranges.flags.writeable)

        beams = self.beams(deed)
        beams.tick()
        dtype, owns, writeable, ranges = views[0]
        self.assertEqual((dtype, owns, writeable), (numpy.dtype("float32"), False, False))
        self.assertEqual(ranges.tolist(), [1.0, 2.0, 3.5])
        self.assertEqual(beams.output("copy")["ranges"], [7.0, 8.0])

    def test_an_array_that_outlives_its_tick_fails_it(self):
        def deed(beams):
            beams._kept["array"] = beams.scan.get().ranges

        message = self.refusal(deed, RuntimeError)
        self.assertIn("`ranges` of LaserScan", message)
        self.assertIn("copy", message)

    def test_a_value_is_refused_after_its_tick(self):
        kept = []
        beams = self.beams(lambda beams: kept.append(beams.scan.get()))
        beams.tick()
        with self.assertRaisesRegex(RuntimeError, "a value of LaserScan is used after its tick"):
            kept[0].angle_min

    def test_a_wrong_type_or_shape_names_both(self):
        doubles = self.refusal(lambda beams: beams.copy.set({**SCAN, "ranges": numpy.zeros(3)}))
        self.assertIn("port `copy`: `ranges` of LaserScan: expected float32 of shape (3,), found float64 of shape (3,)", doubles)

        def reshaped(beams):
            beams.copy.write(4).ranges = numpy.zeros((2, 2), "f4")

        self.assertIn("expected float32 of shape (4,), found float32 of shape (2, 2)", self.refusal(reshaped))
        text = self.refusal(lambda beams: beams.motion.set(linear="fast", angular=0.0))
        self.assertIn("`linear` of Twist2: expected f64, found 'fast' (str)", text)
        missing = self.refusal(lambda beams: beams.motion.set(linear=1.0))
        self.assertIn("Twist2 needs its field `angular`; it has linear, angular", missing)
        unknown = self.refusal(lambda beams: beams.motion.set(linear=1.0, angular=0.0, up=2.0))
        self.assertIn("Twist2 has no field up", unknown)
        many = self.refusal(lambda beams: beams.copy.write(9), ValueError)
        self.assertIn("`copy` with 9 items has room for 8", many)
        result = self.refusal(lambda beams: "done")
        self.assertIn("tick returned done: expected an Outcome or None", result)

    def test_state_is_saved_and_restored_with_arrays(self):
        beams = self.beams()
        beams.tick()
        beams.module.history = numpy.arange(6.0).reshape(2, 3)
        other = slate.Fixture(Beams)
        other.restore(beams.save())
        self.assertEqual(other.module.seen, [6.5])
        self.assertEqual(other.module.history.tolist(), [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
        self.assertEqual(slate.Fixture(Beams).module.seen, [], "each instance has a state of its own")

    def test_a_state_that_does_not_fit_is_refused(self):
        class Before(slate.Module, stage="Think"):
            steps: int = 3

            def tick(self, now): ...

        class After(slate.Module, stage="Think"):
            steps: str = "three"

            def tick(self, now): ...

        saved = slate.Fixture(Before).save()
        with self.assertRaisesRegex(ValueError, "`steps`: expected str, found int"):
            slate.Fixture(After).restore(saved)

    def test_an_undeclared_state_is_refused(self):
        def deed(beams):
            beams.total = 1

        self.assertIn("declares no state `total`", self.refusal(deed, AttributeError))

    def test_parameters_are_checked_and_followed(self):
        class Gain(slate.Module, stage="Think"):
            motion = slate.Output("Twist2")
            gain = slate.Parameter(0.5, range=(0.0, 1.0), unit="1/s", doc="gain")

            def tick(self, now):
                self.motion.set(linear=self.gain, angular=0.0)

        gain = slate.Fixture(Gain, gain=0.25)
        gain.tick()
        self.assertEqual(gain.output("motion")["linear"], 0.25)
        gain.params(gain=1.0)
        gain.tick()
        self.assertEqual(gain.output("motion")["linear"], 1.0)
        with self.assertRaisesRegex(ValueError, "gain: expected 0 to 1, found 2"):
            gain.params(gain=2)

    def test_messages_cross_with_refusals(self):
        class Postman(slate.Module, stage="Think"):
            inbox = slate.Inbox("Point2")
            queue = slate.Queue("Point2")
            outbox = slate.Outbox("Point2", window=2)

            def tick(self, now):
                for message in self.inbox:
                    if message.x < 0.0:
                        message.refuse(7)
                    self.outbox.send(x=message.x, y=now.seconds())
                for value in self.queue:
                    self.outbox.send(value.value())

        postman = slate.Fixture(Postman)
        postman.advance(2.0)
        postman.push("inbox", x=-1.0, y=0.0)
        postman.push("queue", x=4.0, y=5.0)
        postman.tick()
        self.assertEqual(postman.sent("outbox"), [{"x": -1.0, "y": 2.0}, {"x": 4.0, "y": 5.0}])

    def test_an_interface_can_be_its_own(self):
        class Battery(slate.Interface):
            """State of the batteries."""

            charge = slate.Field("f64", doc="Remaining charge, 0 to 1.")
            cells = slate.Field("Sequence<f64, 4>", unit="V")
            name = slate.Field("Text<12>")
            place = slate.Field("Pose2")
            raw = slate.Field("[[u8; 2]; 2]")

        class Charger(slate.Module, stage="Think"):
            battery = slate.Output(Battery)

            def tick(self, now):
                battery = self.battery.write()
                battery.cells = [1.0, 2.0]
                battery.name = "left"
                battery.place.x = 3.0
                battery.raw[:] = [[1, 2], [3, 4]]

        charger = slate.Fixture(Charger)
        charger.tick()
        expected = {"charge": 0.0, "cells": [1.0, 2.0], "name": "left", "place": {"x": 3.0, "y": 0.0, "theta": 0.0}}
        self.assertEqual(charger.output("battery"), expected | {"raw": [[1, 2], [3, 4]]})

    def test_a_mistake_in_a_declaration_says_what_helps(self):
        with self.assertRaisesRegex(ValueError, "no interface `Pose3` is known: did you mean Pose2"):
            slate.Input("Pose3")
        with self.assertRaisesRegex(ValueError, 'expected a duration such as "200ms", found \'fast\''):
            type("Odd", (slate.Module,), {"tick": lambda self, now: None}, stage="Think", every="fast")
        with self.assertRaisesRegex(ValueError, "stage of Odd: `Thinking` is none"):
            type("Odd", (slate.Module,), {"tick": lambda self, now: None}, stage="Thinking")

    def test_without_numpy_an_array_says_what_is_missing(self):
        code = """
import sys
sys.modules["numpy"] = None
import slate
class Reader(slate.Module, stage="Think"):
    scan = slate.Input("LaserScan")
    def tick(self, now):
        print(self.scan.get().to_dict()["ranges"])
        self.scan.get().ranges
reader = slate.Fixture(Reader)
reader.set("scan", angle_min=0.0, angle_increment=0.1, range_min=0.0, range_max=1.0, ranges=[0.5])
reader.tick()
"""
        ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        self.assertEqual(ended.stdout.strip(), "[0.5]")
        self.assertIn("`ranges` of LaserScan is an array, which needs numpy: pip install numpy", ended.stderr)


class InAgent(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        variables = {"XDG_RUNTIME_DIR": str(cls.folder), "XDG_STATE_HOME": str(cls.folder / "state")}
        cls.enterClassContext(unittest.mock.patch.dict(os.environ, variables))
        (cls.folder / "odd.py").write_text(MODULES)
        (cls.folder / "odd.toml").write_text(CONFIGURATION)
        cls.agent = cls.enterClassContext(slate.start(cls.folder / "odd.toml", out=cls.folder / "out"))

    def count(self):
        return self.agent["/counter/count"].wait(timeout=5).value

    def process(self):
        return self.agent["/villain/process"].value

    def fail(self, deed):
        """Lets the villain do something, and returns how its process ended."""
        before = self.process()
        self.agent["/villain/order"].send({"x": float(deed), "y": 0.0})
        after = seconds(20, lambda: (now := self.process())["restarts"] > before["restarts"] and now)
        seconds(20, lambda: self.agent["/villain/alive"].value["x"] > 0.0)
        return after["last_end"]

    def test_a_module_ticks_with_its_parameters(self):
        first = self.count()["x"]
        self.agent["/counter/count"].wait(lambda count: count["x"] >= first + 3, timeout=5)
        self.agent["/counter/params/step"].value = 10.0
        at = self.count()["x"]
        self.agent["/counter/count"].wait(lambda count: count["x"] >= at + 50.0, timeout=5)
        with self.assertRaises(slate.Refused):
            self.agent["/counter/params/step"].value = 11.0

    def test_faults_end_only_the_module(self):
        # The process is shown a moment after it was exchanged by another test.
        command = lambda: Path(f"/proc/{self.process()['id']}/cmdline")
        seconds(10, lambda: command().exists() and "slate.host" in command().read_text())
        before = self.count()["x"]
        self.assertEqual(self.fail(1), "panicked")
        self.assertIn("panicked", self.fail(2))
        self.assertIn("did not return within 1s", self.fail(3))
        self.assertIn("ended with exit code 3", self.fail(4))
        self.assertIn("ended by signal 9 (killed)", self.fail(5))
        self.agent["/counter/count"].wait(lambda count: count["x"] > before + 3, timeout=5)
        log = "\n".join(line["text"] for line in self.agent.call("GET", "/log?module=villain"))
        self.assertIn("Traceback (most recent call last):", log)
        self.assertIn('odd.py", line', log)
        self.assertIn("KeyError: 'no such key'", log)
        self.assertIn("SystemExit", log)

    def test_a_reload_keeps_the_state(self):
        before = self.count()["x"]
        source = self.folder / "odd.py"
        source.write_text(MODULES.replace("VERSION = 1.0", "VERSION = 2.0"))
        self.agent.call("POST", "/plugins/odd/reload", {})
        changed = self.agent["/counter/count"].wait(lambda count: count["y"] == 2.0, timeout=10).value
        self.assertGreaterEqual(changed["x"], before)
        source.write_text("def broken(:\n")
        with self.assertRaises(slate.Refused) as refused:
            self.agent.call("POST", "/plugins/odd/reload", {})
        self.assertIn("SyntaxError", str(refused.exception))
        self.assertIn("odd.py, line 1", str(refused.exception))
        self.agent["/counter/count"].wait(lambda count: count["x"] > changed["x"] + 2, timeout=5)

    def test_a_snapshot_has_the_state(self):
        # So slowly that the state is seen before it has caught up.
        self.agent["/counter/params/step"].value = 1.0
        saved = self.count()["x"]
        self.agent.snapshot(self.folder / "here.snapshot")
        self.agent["/counter/count"].wait(lambda count: count["x"] > saved + 150, timeout=30)
        later = self.count()["x"]
        self.agent.resume(self.folder / "here.snapshot")
        back = self.agent["/counter/count"].wait(lambda count: count["x"] < later, timeout=10).value
        self.assertGreaterEqual(back["x"], saved)


class InLockstep(unittest.TestCase):
    def test_a_new_project_is_tested_and_drives_the_same_each_time(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        new = subprocess.run([program(), "new", "rover", "--python"], cwd=folder, capture_output=True, text=True)
        self.assertEqual(new.returncode, 0, new.stderr)
        project = Path(folder) / "rover"
        tested = subprocess.run([sys.executable, "-m", "unittest"], cwd=project, capture_output=True, text=True)
        self.assertEqual(tested.returncode, 0, tested.stderr)
        info = subprocess.run(
            [program(), "plugin", "info", project / "rover.py", "--json"], capture_output=True, text=True
        )
        self.assertEqual(json.loads(info.stdout)["modules"][0]["name"], "rover", info.stderr)
        check = [program(), "check", project / "rover.toml", "--strict"]
        checked = subprocess.run(check, capture_output=True, text=True)
        self.assertEqual(checked.returncode, 0, checked.stderr)
        out = project / "out"
        runs = [slate.run(project / "rover.toml", seed=seed, out=out / str(i)) for i, seed in enumerate((1, 1))]
        self.assertEqual(runs[0]["outcome"], "goal_reached", runs[0])
        self.assertEqual(runs[0]["digest"], runs[1]["digest"])

    def test_the_example_wanders_without_a_contact(self):
        example = Path(__file__).parents[1] / "examples/wander/wander.toml"
        out = self.enterContext(tempfile.TemporaryDirectory())
        limit = {"modules.referee.params.time_limit": 15.0}
        summary = slate.run(example, seed=0, set=limit, out=out)
        self.assertEqual(summary["outcome"], "timed_out", summary)

    def test_a_file_that_python_can_not_run_says_why(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        (folder / "odd.toml").write_text(CONFIGURATION)
        for source, expected in [
            ("import no_such_package\n", "ModuleNotFoundError: No module named 'no_such_package' (odd.py:1)"),
            ("import slate\n", "it has no module: expected a class such as"),
        ]:
            (folder / "odd.py").write_text(source)
            with self.assertRaises(slate.ProgramError) as failed:
                slate.run(folder / "odd.toml", out=folder / "out")
            self.assertIn(expected, failed.exception.output)


if __name__ == "__main__":
    unittest.main()
