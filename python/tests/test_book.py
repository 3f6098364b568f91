"""The Python code of the book's chapter does what it says."""

import os
import re
import tempfile
import unittest
import unittest.mock
from pathlib import Path

import slate

BOOK = Path(__file__).parents[2] / "book/src"
CHAPTER = BOOK / "47-python.md"


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

    def test_the_modules_of_the_book_run(self):
        names = {"__name__": "book"}
        chapter = (BOOK / "49-modules-in-python.md").read_text()
        for block in re.findall(r"^```python\n(.*?)^```", chapter, re.M | re.S):
            exec(block, names)
        self.assertEqual(names["charger"].output("battery")["cells"], [12.1, 12.3])


if __name__ == "__main__":
    unittest.main()
