"""Runs of the program `slate`, which is part of this package."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sysconfig
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ._slate import AgentUnreachable, NoAgent, agent_of
from .agent import Agent, connect


class ProgramError(Exception):
    """Run of `slate` that ended with an error."""

    def __init__(self, arguments: Sequence[str], status: int, output: str) -> None:
        super().__init__(f"slate {' '.join(arguments)} ended with exit code {status}:\n{output.strip()}")
        self.status = status
        """Exit code, as the book's chapter on the command line lists them."""
        self.output = output
        """What it printed on stderr."""


def program() -> Path:
    """File of the program `slate`: that of this environment, or else the first in PATH."""
    beside = Path(sysconfig.get_path("scripts")) / "slate"
    if beside.exists():
        return beside
    found = shutil.which("slate")
    if found is None:
        raise FileNotFoundError("the program `slate` is neither in this environment nor in PATH: pip install --force-reinstall slate-robotics")
    return Path(found)


def run(
    name: str | os.PathLike[str],
    *,
    seed: int | None = None,
    set: Mapping[str, Any] | None = None,
    out: str | os.PathLike[str] | None = None,
    rate: float | str | None = None,
    arguments: Sequence[str] = (),
) -> dict[str, Any]:
    """Runs an example or a configuration headless until its mission ends, and returns the summary.

    `set` overrides settings, such as `{"robots.r2.modules.planner.params.max_linear_velocity": 0.3}`. The report is
    written into the folder `out`. A run whose mission fails returns its summary; one that can't run raises `ProgramError`.
    """
    words = ["run", os.fspath(name), "--headless", *_words(seed, set, out), *arguments]
    if rate is not None:
        words += ["--rate", str(rate)]
    return _summary(words)


def batch(
    name: str | os.PathLike[str],
    *,
    runs: int = 20,
    seed: int | None = None,
    set: Mapping[str, Any] | None = None,
    out: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
) -> dict[str, Any]:
    """Runs an example with many seeds, and returns the statistics."""
    words = ["batch", os.fspath(name), "--runs", str(runs), *_words(seed, set, out)]
    if jobs is not None:
        words += ["--jobs", str(jobs)]
    return _summary(words)


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
    process = subprocess.Popen([program(), *words], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        yield _connect(process, words, timeout)
    finally:
        process.terminate()
        try:
            process.communicate(timeout=10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def _connect(process: subprocess.Popen[str], words: Sequence[str], timeout: float) -> Agent:
    until = time.monotonic() + timeout
    while time.monotonic() < until:
        if process.poll() is not None:
            raise ProgramError(words, process.returncode, process.stderr.read() if process.stderr else "")
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
        words += ["--set", f"{path}={value if isinstance(value, str) else json.dumps(value)}"]
    if out is not None:
        words += ["--out", os.fspath(out)]
    return words


def _summary(words: list[str]) -> dict[str, Any]:
    """Last line of stdout, which is JSON; without one the program has failed."""
    ended = subprocess.run([program(), *words, "--json"], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    lines = ended.stdout.strip().splitlines()
    try:
        return json.loads(lines[-1])
    except (IndexError, ValueError):
        raise ProgramError(words, ended.returncode, ended.stderr or ended.stdout) from None
