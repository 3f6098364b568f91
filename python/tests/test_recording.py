"""Recordings as arrays, data frames and tables."""

import os
import sys
import tempfile
import unittest
import unittest.mock
from pathlib import Path

import slate


class Recording(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.poses = []
        with slate.Simulation("exp1", seed=3, record=Path(cls.folder.name) / "run.mcap") as simulation:
            while simulation.step() and simulation.cycle < 200:
                cls.poses.append(simulation["/simulator/r2/truth/x"].value)
        cls.file = simulation.recording
        cls.recording = slate.open_recording(cls.file)

    def test_topics_have_their_interfaces(self):
        self.assertEqual(self.recording.topics["/simulator/r2/truth"], "Pose2")
        self.assertIn("/r2/sonar/value", list(self.recording))
        self.assertIn("exp1", self.recording.configuration)

    def test_columns_are_the_values_with_their_times(self):
        import numpy

        truth = self.recording["/simulator/r2/truth"]
        self.assertEqual(truth.fields, ["x", "y", "theta"])
        self.assertEqual(truth["x"].dtype, numpy.float64)
        self.assertEqual(list(truth["x"][: len(self.poses)]), self.poses)
        self.assertTrue(numpy.allclose(numpy.diff(truth.time), 0.02))
        self.assertEqual(list(self.recording["/simulator/r2/truth/x"]), list(truth["x"]))

    def test_columns_are_those_of_the_command(self):
        import json
        import subprocess

        url = "/simulator/r2/truth"
        words = [slate.program(), "bag", "cat", self.file, url, "--json"]
        lines = subprocess.run(words, capture_output=True, text=True, check=True).stdout.splitlines()
        messages = [json.loads(line) for line in lines]
        truth = self.recording[url]
        self.assertEqual(len(messages), len(truth))
        for field in truth.fields:
            self.assertEqual([message["value"][field] for message in messages], list(truth[field]))

    def test_lists_are_rows_and_enumerations_names(self):
        ranges = self.recording["/r2/sonar/value/echoes/range"]
        self.assertEqual(ranges.ndim, 2)
        self.assertEqual(len(ranges), len(self.recording["/r2/sonar/value"]))
        states = self.recording["/referee/verdict/state"]
        self.assertEqual(set(states), {"RUNNING"})

    def test_a_part_of_the_time_is_selected(self):
        whole = self.recording["/simulator/r2/truth"]
        part = self.recording.topic("/simulator/r2/truth", start=1.0, end=2.0)
        self.assertLess(len(part), len(whole))
        self.assertEqual(list(part["x"]), list(whole["x"][(whole.time >= part.time[0]) & (whole.time <= part.time[-1])]))

    def test_a_data_frame_has_the_time_as_index(self):
        frame = self.recording["/simulator/r2/truth"].to_pandas()
        self.assertEqual(frame.index.name, "time")
        self.assertEqual(list(frame.columns), ["x", "y", "theta"])
        echoes = self.recording["/r2/sonar/value"].to_pandas()
        self.assertEqual(len(echoes["echoes/range"].iloc[0]), self.recording["/r2/sonar/value/echoes/range"].shape[1])

    def test_a_table_of_arrow_has_lists(self):
        import pyarrow

        table = self.recording["/r2/sonar/value"].to_arrow()
        self.assertEqual(table.schema.field("time").type, pyarrow.duration("ns"))
        self.assertEqual(table.schema.field("echoes/range").type, pyarrow.list_(pyarrow.float64()))
        row = table["echoes/range"][5].as_py()
        self.assertEqual(row, list(self.recording["/r2/sonar/value/echoes/range"][5]))

    def test_images_are_arrays(self):
        file = Path(self.folder.name) / "camera.mcap"
        with slate.Simulation("rescue_camera", record=file) as simulation:
            simulation.step(20)
        recording = slate.open_recording(file)
        url = next(url for url, interface in recording.topics.items() if interface == "Image")
        image = recording[url].images()[0]
        self.assertEqual(image.shape[:2], (recording[url]["height"][0], recording[url]["width"][0]))
        with self.assertRaisesRegex(TypeError, "expected the interface OccupancyGrid"):
            recording[url].grids()

    def test_maps_are_arrays(self):
        file = Path(self.folder.name) / "mapping.mcap"
        with slate.Simulation("mapping", record=file) as simulation:
            simulation.step(60)
        recording = slate.open_recording(file)
        url = next(url for url, interface in recording.topics.items() if interface == "OccupancyGrid")
        cells = recording[url].grids()[-1]
        self.assertEqual(cells.shape, (recording[url]["height"][-1], recording[url]["width"][-1]))
        self.assertEqual(cells.min(), -1)
        self.assertGreater(cells.max(), 50)

    def test_a_recording_is_verified_by_the_command(self):
        import json
        import subprocess

        words = [slate.program(), "replay", "--verify", "--json", self.file]
        verified = subprocess.run(words, capture_output=True, text=True, check=False)
        self.assertEqual(json.loads(verified.stdout)["outcome"], "identical", verified.stderr)

    def test_what_is_not_there_is_named(self):
        with self.assertRaisesRegex(KeyError, "did you mean /simulator/r2/truth"):
            _ = self.recording["/simulator/r2/trut"]
        with self.assertRaisesRegex(KeyError, "it has x, y, theta"):
            _ = self.recording["/simulator/r2/truth/z"]
        with self.assertRaises(FileNotFoundError):
            slate.open_recording("nowhere.mcap")

    def test_a_damaged_file_says_how_it_is_repaired(self):
        damaged = Path(self.folder.name) / "damaged.mcap"
        content = bytearray(self.file.read_bytes())
        content[len(content) // 2] ^= 0xFF
        damaged.write_bytes(content)
        with self.assertRaisesRegex(Exception, "slate bag repair"):
            slate.open_recording(damaged)

    def test_missing_packages_are_named(self):
        topic = self.recording["/simulator/r2/truth"]
        for module, call in (("pandas", topic.to_pandas), ("pyarrow", topic.to_arrow)):
            with unittest.mock.patch.dict(sys.modules, {module: None}), self.assertRaisesRegex(ImportError, "pip install"):
                call()


if __name__ == "__main__":
    unittest.main()
