"""Modules in Python: in a fixture, in agents, with faults, across reloads and snapshots."""

import enum
import gc
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import traceback
import typing
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
    """Fails in the way that a message orders."""

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


class Gear(enum.IntEnum):
    REVERSE = -1
    FIRST = 1


class Color(enum.Enum):
    RED = "red"
    BLUE = "blue"


class Place(typing.NamedTuple):
    x: float
    y: float


class Keeper(slate.Module, stage="Think"):
    """Keeps states of all types."""

    # Annotated, and yet no state; the type of the second is declared nowhere.
    pose: slate.Input = slate.Input("Pose2")
    later: "NotYet" = None
    pairs: list = []
    anything: object = None
    gear: Gear = Gear.FIRST
    color: Color = Color.BLUE
    place: Place = Place(0.0, 0.0)
    count: int = 0
    level: int = 0
    gain: float = 0.0

    def tick(self, now): ...


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

    def test_comparing_a_value_of_an_earlier_tick_fails(self):
        def deed(beams):
            now, before = beams.copy.write(1), beams._kept.get("value")
            beams._kept["value"] = now
            if before is not None:
                for first, second in ((before, now), (now, before)):
                    with self.assertRaises(RuntimeError):
                        _ = first == second

        beams = self.beams(deed)
        beams.tick()
        beams.tick()

    def test_an_array_that_only_a_cycle_holds_is_no_failure(self):
        def deed(beams):
            ranges = beams.scan.get().ranges
            try:
                ranges[0] = 5.0
            except ValueError as error:
                kept = error
            self.assertIn("read-only", str(kept))

        gc.disable()
        self.addCleanup(gc.enable)
        self.assertEqual(self.beams(deed).tick(), slate.Outcome.OK)

    def test_a_kept_array_outlives_its_fixture(self):
        def deed(beams):
            copy = beams.copy.write(8)
            copy.ranges[:] = 7.0
            kept.append(copy.ranges)
            kept.append(beams.scan.get().ranges)

        kept = []
        beams = self.beams(deed)
        with self.assertRaises(RuntimeError):
            beams.tick()
        del beams
        gc.collect()
        others = [self.beams() for _ in range(100)]
        self.assertEqual(kept[0].tolist(), [7.0] * 8)
        self.assertEqual(kept[1].tolist(), [1.0, 2.0, 3.5])
        del others

    def test_a_kept_array_outlives_its_message(self):
        class Reader(slate.Module, stage="Think"):
            queue = slate.Queue("LaserScan")

            def tick(self, now):
                kept.extend(scan.ranges for scan in self.queue)

        kept = []
        reader = slate.Fixture(Reader)
        reader.push("queue", SCAN)
        with self.assertRaises(RuntimeError):
            reader.tick()
        for _ in range(20):
            reader.push("queue", {**SCAN, "ranges": [9.0, 9.0, 9.0]})
            self.assertEqual(kept[0].tolist(), [1.0, 2.0, 3.5])

    def test_ports_and_the_tick_are_for_its_thread_only(self):
        class Threaded(slate.Module, stage="Think"):
            motion = slate.Output("Twist2")

            def tick(self, now):
                def work():
                    uses = (
                        lambda: self.motion.set(linear=1.0, angular=0.0),
                        now.normal,
                        lambda: setattr(motion, "linear", 1.0),
                    )
                    for use in uses:
                        try:
                            use()
                        except RuntimeError as error:
                            errors.append(str(error))

                motion = self.motion.write()
                thread = threading.Thread(target=work)
                thread.start()
                thread.join()

        errors = []
        threaded = slate.Fixture(Threaded)
        threaded.tick()
        self.assertEqual(errors[0], "the port `motion` is used by another thread: only `tick` may; pass copies")
        self.assertIn("a tick is used by another thread", errors[1])
        self.assertIn("a value of Twist2 is used by another thread", errors[2])
        self.assertEqual(threaded.output("motion"), {"linear": 0.0, "angular": 0.0})

    def test_a_field_named_as_a_method_is_read_by_its_name(self):
        class Reading(slate.Interface):
            value = slate.Field("f64")
            stamp = slate.Field("u32")
            get = slate.Field("bool")

        class Reader(slate.Module, stage="Think"):
            required = slate.Required(Reading)
            inbox = slate.Inbox(Reading)

            def tick(self, now):
                for values in (self.required, *self.inbox):
                    read.append([values[name] for name in ("value", "stamp", "get")])

        read = []
        reader = slate.Fixture(Reader)
        reader.set("required", value=0.5, stamp=3, get=True)
        reader.push("inbox", value=1.5, stamp=4, get=False)
        reader.tick()
        self.assertEqual(read, [[0.5, 3, True], [1.5, 4, False]])

    def test_random_numbers_are_the_same_in_each_run(self):
        code = """
import sys
import slate
class One(slate.Module, stage="Think"):
    def create(self, setup):
        import random, numpy
        print(random.random(), numpy.random.random())
    def tick(self, now): ...
class Two(One, stage="Think"):
    def tick(self, now): ...
slate.Fixture(One), slate.Fixture(Two)
"""
        runs = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True) for _ in range(2)]
        self.assertEqual(runs[0].stdout, runs[1].stdout, runs[0].stderr)
        one, two = runs[0].stdout.splitlines()
        for drawn in zip(one.split(), two.split(), strict=True):
            self.assertNotEqual(*drawn)

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

    def restored(self, **state):
        """Saves a state and returns what is restored."""
        saved, other = slate.Fixture(Keeper), slate.Fixture(Keeper)
        for name, value in state.items():
            setattr(saved.module, name, value)
        other.restore(saved.save())
        values = [getattr(other.module, name) for name in state]
        return values if len(values) > 1 else values[0]

    def test_a_saved_state_comes_back_as_it_was(self):
        self.assertEqual(self.restored(pairs=[(1, 2.0), ("a", [(3,)])]), [(1, 2.0), ("a", [(3,)])])
        self.assertEqual(self.restored(anything=(1, (2, None))), (1, (2, None)))
        for odd in ({"$tuple": [1]}, {"$dict": {"$array": 2}}, {"dtype": 1, "shape": 2, "data": 3}):
            self.assertEqual(self.restored(anything=odd), odd)
        gear, color, place = self.restored(gear=Gear.REVERSE, color=Color.RED, place=Place(1.0, 2.0))
        self.assertIs(gear, Gear.REVERSE)
        self.assertIs(color, Color.RED)
        self.assertEqual((type(place), place.y), (Place, 2.0))
        count, gain, level = self.restored(count=numpy.int64(3), gain=2, level=Gear.REVERSE)
        self.assertEqual([(type(value), value) for value in (count, gain, level)], [(int, 3), (float, 2.0), (int, -1)])

    def test_a_saved_array_keeps_its_fields(self):
        padded = numpy.dtype({"names": ["x", "raw"], "formats": ["f4", ("u1", (3,))], "offsets": [0, 8], "itemsize": 16})
        points = numpy.zeros(2, padded)
        points["x"] = [1.0, 2.0]
        for array in (points, numpy.array(["2026-01-01"], "M8[s]"), numpy.arange(6, dtype=">i2").reshape(2, 3)):
            back = self.restored(anything=array)
            self.assertEqual((back.dtype, back.shape), (array.dtype, array.shape))
            self.assertEqual(back.tobytes(), array.tobytes())
        self.assertEqual(self.restored(anything=[points])[0].dtype, padded)

    def test_a_state_that_could_not_be_restored_is_not_saved(self):
        for state, reason in [
            ({"count": 0.5}, "`count`: expected int, found float"),
            ({"pairs": (1,)}, "`pairs`: expected list, found tuple"),
            ({"gear": 7}, "`gear`: expected Gear, found int"),
            ({"gear": Color.RED}, "`gear`: expected Gear, found Color"),
            ({"anything": Place(0.0, 0.0)}, "`anything`: expected a plain value, found Place"),
            ({"pairs": [Gear.FIRST]}, "a Gear can't be saved inside of another value"),
            ({"anything": {1, 2}}, "a set can't be saved here: only None, booleans"),
            ({"anything": {1: 2}}, "the key 1 of a dict is not a text"),
        ]:
            with self.assertRaises((ValueError, TypeError)) as raised:
                self.restored(**state)
            self.assertIn(reason, str(raised.exception))

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

    def test_items_are_written_from_a_view_of_themselves(self):
        class Cells(slate.Interface):
            """Voltages."""

            cells = slate.Field("Sequence<f64, 4>", unit="V")
            limits = slate.Field("Optional<[f64; 2]>", unit="V")
            place = slate.Field("Optional<Pose2>")
            rows = slate.Field("Sequence<[f64; 2], 4>")
            raw = slate.Field("[[u8; 2]; 2]")

        class Doubler(slate.Module, stage="Think"):
            out = slate.Output(Cells)

            def tick(self, now):
                out = self.out.write()
                out.cells = [1.0, 2.0, 3.0]
                out.cells *= 2
                out.cells = out.cells[1:]
                out.limits = [1.0, 5.0]
                out.limits = out.limits * 2
                out.limits = out.limits[::-1]
                out.place = {"x": 1.0, "y": 2.0, "theta": 0.0}
                place = out.place
                place.x = 3.0
                out.place = place
                out.rows = [[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]
                out.rows = [row for row in out.rows if row[0] > 0.0]
                out.raw[:] = [[1, 2], [3, 4]]
                out.raw = [out.raw[1], out.raw[0]]

        doubler = slate.Fixture(Doubler)
        doubler.tick()
        expected = {"cells": [4.0, 6.0], "limits": [10.0, 2.0], "place": {"x": 3.0, "y": 2.0, "theta": 0.0}}
        expected |= {"rows": [[2.0, 3.0], [4.0, 5.0]], "raw": [[3, 4], [1, 2]]}
        self.assertEqual(doubler.output("out"), expected)

    def test_a_mistake_in_a_declaration_says_what_helps(self):
        with self.assertRaisesRegex(ValueError, "no interface `Pose3` is known: did you mean Pose2"):
            slate.Input("Pose3")
        with self.assertRaisesRegex(ValueError, 'expected a duration such as "200ms", found \'fast\''):
            type("Odd", (slate.Module,), {"tick": lambda self, now: None}, stage="Think", every="fast")
        with self.assertRaisesRegex(ValueError, "unknown stage `Thinking` of Odd: expected PreLoop"):
            type("Odd", (slate.Module,), {"tick": lambda self, now: None}, stage="Thinking")
        tick = {"tick": lambda self, now: None}
        for members, triggers, reason in [
            ({}, {}, "Odd has no `def tick"),
            ({**tick, "__init__": lambda self: None}, {}, "`__init__`, which is not called: use `def create"),
            (tick, {"every": "10ms", "on": "pose"}, "has `every` and `on`: a module has one trigger"),
            (tick, {"timeout": "1s"}, "has a `timeout` without `on`"),
        ]:
            with self.assertRaisesRegex(TypeError, reason):
                type("Odd", (slate.Module,), members, stage="Think", **triggers)

    def test_a_traceback_shows_the_source_that_runs(self):
        from slate.host import load

        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.enterContext(unittest.mock.patch.object(sys, "path", list(sys.path)))
        source, copy = folder / "edited_later.py", folder / "copy"
        text = MODULES + "\n\nDefault = Counter\nraised = lambda: 1 / 0  # as it was\n"
        copy.write_text(text)
        source.write_text("\n" * 300)
        self.assertEqual([kind.__name__ for kind in load(source, copy)], ["Counter", "Villain"], "each is one kind")
        try:
            sys.modules.pop("edited_later").raised()
        except ZeroDivisionError:
            shown = traceback.format_exc()
        self.assertIn("# as it was", shown)

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
        # The interpreter of its module is this one, which a link in the environment names.
        with slate.Simulation(project / "rover.toml", seed=1) as simulation:
            self.assertEqual(simulation.run()["digest"], runs[0]["digest"])

    def test_the_example_wanders_without_a_contact(self):
        example = Path(__file__).parents[1] / "examples/wander/wander.toml"
        out = self.enterContext(tempfile.TemporaryDirectory())
        limit = {"modules.referee.params.time_limit": 15.0}
        summary = slate.run(example, seed=0, set=limit, out=out)
        self.assertEqual(summary["outcome"], "timed_out", summary)

    def test_a_package_of_another_build_names_both_versions(self):
        ours, theirs = socket.socketpair()
        command = [sys.executable, "-P", "-m", "slate.host"]
        with ours, subprocess.Popen(command, stdin=theirs, stdout=subprocess.DEVNULL) as process:
            theirs.close()
            build = b"9.9.9 1 2 3 4"
            # The byte that brings the shared memory, and the first request: its topic, code and length.
            ours.sendall(b"\0" + struct.pack("=IiI", 12, 0, len(build)) + build)
            topic, code, length = struct.unpack("=IiI", ours.recv(12, socket.MSG_WAITALL))
            refusal = ours.recv(length, socket.MSG_WAITALL).decode()
            self.assertEqual(process.wait(10), 0)
        self.assertNotEqual(code, 0)
        self.assertEqual(refusal, f"the package slate-robotics is {slate.__version__}, the agent 9.9.9")

    def test_what_a_module_prints_is_no_output_of_the_program(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        noise = 'import os, subprocess\nos.write(1, b"noise 1\\n")\nsubprocess.run(["echo", "noise 2"])\nprint("noise 3")\n'
        (folder / "odd.py").write_text(noise + MODULES)
        command = [program(), "plugin", "info", folder / "odd.py", "--json"]
        ended = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual(len(json.loads(ended.stdout)["modules"]), 2)
        for number in (1, 2, 3):
            self.assertIn(f"noise {number}", ended.stderr)

    def test_open_files_of_the_agent_are_kept_from_a_module(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        reader, writer = os.pipe()
        self.addCleanup(os.close, reader)
        self.addCleanup(os.close, writer)
        look = f"import os\ntry:\n    print('open', os.fstat({writer}))\nexcept OSError:\n    print('kept away')\n"
        (folder / "odd.py").write_text(look + MODULES)
        command = [program(), "plugin", "info", folder / "odd.py"]
        ended = subprocess.run(command, capture_output=True, text=True, pass_fds=[writer])
        self.assertIn("kept away", ended.stderr)

    def test_an_agent_ends_while_a_module_imports_again(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        slow = (
            "import pathlib, time\nfolder = pathlib.Path(__file__).parent\n"
            "if (folder / 'slow').exists():\n    (folder / 'imports').touch()\n    time.sleep(50.0)\n"
        )
        (folder / "odd.py").write_text(slow + MODULES)
        (folder / "odd.toml").write_text(CONFIGURATION)
        variables = {"XDG_RUNTIME_DIR": str(folder), "XDG_STATE_HOME": str(folder / "state")}
        self.enterContext(unittest.mock.patch.dict(os.environ, variables))
        command = [program(), "run", folder / "odd.toml", "--out", folder / "out"]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            try:
                agent = seconds(20, lambda: "modules" in slate.agents() and slate.connect("modules"))
                agent["/villain/alive"].wait(timeout=10)
                (folder / "slow").touch()
                agent["/villain/order"].send({"x": 5.0, "y": 0.0})
                seconds(10, (folder / "imports").exists)
                process.send_signal(signal.SIGINT)
                process.wait(10)
            finally:
                process.kill()

    def test_interfaces_are_those_of_plugins_before_in_the_file(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        (folder / "zzz.py").write_text(
            "import slate\n\nclass Batt(slate.Interface):\n    charge = slate.Field('f64')\n\n"
            "class Charger(slate.Module, stage='Think'):\n    batt = slate.Output(Batt)\n    def tick(self, now): ...\n"
        )
        (folder / "aaa.py").write_text(
            "import slate\n\nclass Reader(slate.Module, stage='Think'):\n    batt = slate.Input('Batt')\n"
            "    def tick(self, now): ...\n"
        )
        (folder / "broken.py").write_text("import slate\n\nslate.Input('Pose3')\n")
        plugins = {name: f'[plugins.{name}]\nfile = "{name}.py"\n' for name in ("aaa", "broken", "zzz")}
        variables = {"XDG_RUNTIME_DIR": str(folder), "XDG_STATE_HOME": str(folder / "state")}
        self.enterContext(unittest.mock.patch.dict(os.environ, variables))
        robot = folder / "robot.toml"
        robot.write_text(plugins["zzz"] + plugins["aaa"] + plugins["broken"] + "load = false\n[modules.reader]\n")
        with slate.start(robot, out=folder / "out") as agent:
            lines = seconds(10, lambda: [line["text"] for line in agent.call("GET", "/log") if "broken" in line["text"]])
        self.assertIn("plugin broken with `load = false` can't be read", lines[0])
        self.assertIn("did you mean Pose2", lines[0])
        self.assertIn("(broken.py:3)", lines[0])
        robot.write_text(plugins["aaa"] + plugins["zzz"] + "[modules.reader]\n")
        with self.assertRaises(slate.ProgramError) as failed:
            slate.run(robot, out=folder / "out")
        self.assertIn("no interface `Batt` is known", failed.exception.output)
        self.assertIn("(aaa.py:4)", failed.exception.output)

    def test_a_file_that_python_can_not_run_says_why(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        (folder / "odd.toml").write_text(CONFIGURATION)
        create = MODULES.replace("    def tick", "    def create(self, setup):\n        JSON.loads('{')\n\n    def tick", 1)
        line = 1 + create[: create.index("JSON")].count("\n")
        for source, expected in [
            ("import slate\n\nslate.Input('Pose3')\n", "no interface `Pose3` is known: did you mean Pose2? (odd.py:3)"),
            (create.replace("import os,", "import json as JSON, os,"), f"(odd.py:{line})"),
            (create.replace("import os,", "import json as JSON, os,"), "Traceback (most recent call last):"),
            ("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n", "see why by running it alone: `"),
            ("import no_such_package\n", "ModuleNotFoundError: No module named 'no_such_package' (odd.py:1)"),
            ("import slate\n", "it has no module: expected a class such as"),
        ]:
            (folder / "odd.py").write_text(source)
            with self.assertRaises(slate.ProgramError) as failed:
                slate.run(folder / "odd.toml", out=folder / "out")
            self.assertIn(expected, failed.exception.output)


if __name__ == "__main__":
    unittest.main()
