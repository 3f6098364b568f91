"""The Python code of the book's chapter does what it says."""

import os
import re
import sys
import tempfile
import time
import unittest
import unittest.mock
from pathlib import Path

import slate

BOOK = Path(__file__).parents[2] / "book/src"
CHAPTER = BOOK / "47-python.md"


WORLD = '''
import slate


class World(slate.Module, stage="Think"):
    """Publishes what the module of the book reads."""

    pose = slate.Output("Pose2")
    scan = slate.Output("LaserScan", capacity=8)

    def tick(self, now):
        self.pose.set(x=1.0, y=0.0, theta=0.0)
        self.scan.set(angle_min=0.0, angle_increment=0.1, range_min=0.1, range_max=9.0, ranges=[1.0, 2.0])
'''

LINKED = """
[agent]
name = "book"

[plugins.world]
file = "world.py"

[modules.world]

[links]
"follower/pose" = "world/pose"
"follower/scan" = "world/scan"
"""


class Book(unittest.TestCase):
    def test_the_code_of_the_chapter_runs(self):
        blocks = re.findall(r"^```python\n(.*?)^```", CHAPTER.read_text(), re.M | re.S)
        self.assertEqual(len(blocks), 6)
        before = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                names = {}
                alone = unittest.mock.patch.dict(os.environ, XDG_RUNTIME_DIR=folder)
                with alone, slate.start("exp1", seed=0):
                    for block in blocks[:2]:
                        exec(block, names)
                for block in blocks[2:]:
                    exec(block, names)
            finally:
                os.chdir(before)
        self.assertEqual(names["result"]["seed"], 3)
        self.assertTrue(names["result"].succeeded)
        self.assertEqual(list(names["frame"].columns), ["x", "y", "theta"])

    def blocks(self, language):
        chapter = (BOOK / "49-modules-in-python.md").read_text()
        return re.findall(rf"^```{language}\n(.*?)^```", chapter, re.M | re.S)

    def test_the_modules_of_the_book_run(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        self.enterContext(unittest.mock.patch.object(sys, "path", [folder, *sys.path]))
        self.enterContext(unittest.mock.patch.dict(sys.modules))
        names = {"__name__": "book"}
        module, *blocks = self.blocks("python")
        (Path(folder) / "follow.py").write_text(module)
        for block in blocks:
            exec(block, names)
        self.assertEqual(names["charger"].output("battery")["cells"], [12.1, 12.3])

    def test_the_module_of_the_book_keeps_its_deadline(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        variables = {"XDG_RUNTIME_DIR": str(folder), "XDG_STATE_HOME": str(folder / "state")}
        self.enterContext(unittest.mock.patch.dict(os.environ, variables))
        (folder / "follow.py").write_text(self.blocks("python")[0])
        (folder / "world.py").write_text(WORLD)
        (folder / "robot.toml").write_text(self.blocks("toml")[0] + LINKED)
        with slate.start(folder / "robot.toml", out=folder / "out") as agent:
            agent["/follower/motion"].wait(lambda motion: motion["linear"] == 0.5, timeout=20)
            time.sleep(2.0)
            process = agent["/follower/process"].value
            self.assertEqual((process["restarts"], process["last_end"]), (0, ""))
            self.assertGreater(agent["/follower/motion"].value["linear"], 0.0)


if __name__ == "__main__":
    unittest.main()
