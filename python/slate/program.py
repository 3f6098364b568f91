"""Runs of the program `slate`, which is part of this package."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sysconfig
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ._slate import AgentUnreachable, NoAgent, agent_of
from .agent import Agent, connect
from .settings import setting


class ProgramError(Exception):
    """Run of `slate` that ended with an error."""

    def __init__(self, arguments: Sequence[str], status: int, output: str) -> None:
        super().__init__(f"slate {' '.join(arguments)} ended with exit code {status}:\n{output.strip()}")
        self.status = status
        """Exit code, as the book's chapter on the command line lists them."""
        self.output = output
        """What it printed on stderr."""
        self._arguments = tuple(arguments)

    def __reduce__(self) -> tuple[type[ProgramError], tuple[Any, ...]]:
        return type(self), (self._arguments, self.status, self.output)


def program() -> Path:
    """File of the program `slate`: that of this environment, or else the first in PATH."""
    beside = Path(sysconfig.get_path("scripts")) / "slate"
    if beside.exists():
        return beside
    found = shutil.which("slate")
    if found is None:
        raise FileNotFoundError("the program `slate` is neither in this environment nor in PATH: pip install --force-reinstall slate-robotics")
    return Path(found)


class RunResult(dict[str, Any]):
    """Summary of a run: what `slate run --json` prints, with attributes for what is asked for most."""

    def __init__(self, summary: Mapping[str, Any], report: Path | None, recording: Path | None) -> None:
        super().__init__(summary)
        self.report = report
        """Folder of the report; None if there is none."""
        self.recording = recording
        """File of the recording; None if the run was not recorded."""

    @property
    def outcome(self) -> str:
        """Outcome: `goal_reached`, `collided`, `timed_out`, `stopped` or `failed`."""
        return self["outcome"]

    @property
    def succeeded(self) -> bool:
        """Whether the goal was reached without a caused collision."""
        return self["outcome"] == "goal_reached"

    @property
    def digest(self) -> str:
        """Digest of all values that were written in lockstep."""
        return self["digest"]

    @property
    def path_length(self) -> float | None:
        """Length of the robot's path, m."""
        return self["path_length_m"]

    @property
    def time_to_goal(self) -> float | None:
        """Time at which the robot reached its last goal, s; None if it did not."""
        return self.get("time_to_goal_s")

    def __repr__(self) -> str:
        length = "" if self.path_length is None else f", {self.path_length:.2f} m"
        return f"<RunResult {self['example']} seed {self['seed']}: {self.outcome} in {self['sim_time_s']:.2f} s{length}, digest {self.digest}>"


def run(
    name: str | os.PathLike[str],
    *,
    seed: int | None = None,
    set: Mapping[str, Any] | None = None,
    record: bool | str | os.PathLike[str] = False,
    out: str | os.PathLike[str] | None = None,
    rate: float | str | None = None,
    arguments: Sequence[str] = (),
) -> RunResult:
    """Runs an example or a configuration headless until its mission ends, and returns its summary.

    `set` overrides settings, such as `{"robots.r2.modules.planner.params.max_linear_velocity": 0.3}`. The report is
    written into the folder `out`; `record` records the run into it, or into a file of that name. A run whose mission
    fails returns its summary; one that can't run raises `ProgramError`.
    """
    settings = dict(set or {})
    if record is not False:
        settings["record.enabled"] = True
        if record is not True:
            settings["record.file"] = os.fspath(Path(record).absolute())
    words = ["run", os.fspath(name), "--headless", *_words(seed, settings, out), *arguments]
    if rate is not None:
        words += ["--rate", str(rate)]
    lines, summary = _document(words)
    report = _printed(lines, "report: ")
    recording = _printed(lines, "recording: ")
    recording = recording and recording.rpartition(" (")[0]
    return RunResult(summary, report and Path(report), recording and Path(recording))


def batch(
    name: str | os.PathLike[str],
    *,
    runs: int = 20,
    seed: int | None = None,
    set: Mapping[str, Any] | None = None,
    out: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
) -> Any:
    """Runs an example with many seeds, and returns a table with a row for each run.

    It is a data frame of pandas whose `attrs["statistics"]` is what `slate batch --json` prints; without pandas a
    `BatchTable`, which is a dict of columns. Columns are the entries of a run's summary, and `figures.NAME`.
    """
    with tempfile.TemporaryDirectory() as folder:
        words = ["batch", os.fspath(name), "--runs", str(runs), *_words(seed, set, out or folder)]
        if jobs is not None:
            words += ["--jobs", str(jobs)]
        _, statistics = _document(words)
        with open(Path(out or folder) / "batch.jsonl", encoding="utf-8") as file:
            rows = [_row(json.loads(line)) for line in file]
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {name: [row.get(name) for row in rows] for name in names}
    try:
        import pandas
    except ImportError:
        return BatchTable(columns, statistics)
    table = pandas.DataFrame(columns)
    table.attrs["statistics"] = statistics
    return table


class BatchTable(dict[str, list[Any]]):
    """Runs of a batch as columns by name."""

    def __init__(self, columns: Mapping[str, list[Any]], statistics: dict[str, Any]) -> None:
        super().__init__(columns)
        self.attrs = {"statistics": statistics}
        """What `slate batch --json` prints."""


def _row(summary: dict[str, Any]) -> dict[str, Any]:
    """Entries of a summary, with those of its dicts of numbers and texts."""
    row: dict[str, Any] = {}
    for name, value in summary.items():
        if not isinstance(value, dict):
            row[name] = value
        elif name not in ("robots", "units"):
            row.update({f"{name}.{inner}": entry for inner, entry in value.items()})
    return row


@contextmanager
def start(
    name: str | os.PathLike[str],
    *,
    seed: int | None = None,
    set: Mapping[str, Any] | None = None,
    out: str | os.PathLike[str] | None = None,
    rate: float | str = "realtime",
    timeout: float = 30.0,
) -> Iterator[Agent]:
    """Agent of an example or a configuration that runs while the block lasts.

    Its name is that in the configuration. Raises `ProgramError` when it does not start, `TimeoutError` when it is not
    there after `timeout` seconds.
    """
    words = ["run", os.fspath(name), "--headless", "--stay", "--rate", str(rate), *_words(seed, set, out)]
    process = subprocess.Popen([program(), *words], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    errors = _Errors(process)
    try:
        yield _connect(process, errors, words, timeout)
    except AgentUnreachable as error:
        with suppress(subprocess.TimeoutExpired):
            error.add_note(f"slate {' '.join(words)} ended with exit code {process.wait(1)}:\n{errors.text().strip()}")
        raise
    finally:
        process.terminate()
        try:
            process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        errors.text()


class _Errors:
    """Reads what a program prints on stderr as it comes, so that it never waits for its reader, and keeps the end of it."""

    KEPT = 65536

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stderr is not None
        self._pipe, self._last = process.stderr, b""
        self._thread = threading.Thread(target=self._read, name="stderr of slate", daemon=True)
        self._thread.start()

    def _read(self) -> None:
        with self._pipe as pipe:
            while part := os.read(pipe.fileno(), self.KEPT):
                self._last = (self._last + part)[-self.KEPT :]

    def text(self) -> str:
        """The end of what it has printed, once it has ended."""
        # A process that it has left behind may keep the pipe open.
        self._thread.join(timeout=1)
        return self._last.decode(errors="replace")


def _connect(process: subprocess.Popen[bytes], errors: _Errors, words: Sequence[str], timeout: float) -> Agent:
    until = time.monotonic() + timeout
    while time.monotonic() < until:
        if process.poll() is not None:
            raise ProgramError(words, process.returncode, errors.text())
        name = agent_of(process.pid)
        if name is not None:
            try:
                return connect(name)
            except (NoAgent, AgentUnreachable):
                pass
        time.sleep(0.02)
    raise TimeoutError(f"slate {' '.join(words)}: no agent after {timeout} s")


def _words(seed: int | None, settings: Mapping[str, Any] | None, out: str | os.PathLike[str] | None) -> list[str]:
    words = []
    if seed is not None:
        words += ["--seed", str(seed)]
    for path, value in (settings or {}).items():
        words += ["--set", f"{path}={setting(value)}"]
    if out is not None:
        words += ["--out", os.fspath(out)]
    return words


def _printed(lines: Sequence[str], heading: str) -> str | None:
    """Rest of the line that begins with a heading."""
    return next((line.removeprefix(heading) for line in lines if line.startswith(heading)), None)


def _document(words: list[str]) -> tuple[list[str], dict[str, Any]]:
    """Lines of stdout, and the last of them, which is JSON; without one the program has failed."""
    ended = subprocess.run([program(), *words, "--json"], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    lines = ended.stdout.strip().splitlines()
    try:
        return lines[:-1], json.loads(lines[-1])
    except (IndexError, ValueError):
        raise ProgramError(words, ended.returncode, ended.stderr or ended.stdout) from None
