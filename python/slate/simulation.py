"""Simulations in this process, one cycle at a time."""

from __future__ import annotations

import json
import os
import sys
import sysconfig
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ._slate import DrivenInput, Probe, SteppedAgent
from .arrays import grid_array, image_array, import_numpy, record_array
from .property import Sample, _plain
from .settings import setting


class Simulation:
    """Example or configuration with a simulator, which runs in this process, one cycle at a time.

    The same configuration and seed have the same digest as with `slate run`. `set` overrides settings as `slate.run`
    does, and `record` is the file of a recording. Raises `ConfigurationError` with the command's words.

    >>> with slate.Simulation("exp1", seed=3) as simulation:
    ...     while simulation.step():
    ...         pose = simulation["/simulator/r2/truth"].value
    """

    def __init__(
        self,
        name: str | os.PathLike[str],
        *,
        seed: int | None = None,
        set: Mapping[str, Any] | None = None,
        record: str | os.PathLike[str] | None = None,
    ) -> None:
        sets = [] if seed is None else [f"agent.seed={int(seed)}"]
        sets += [f"{path}={setting(value)}" for path, value in (set or {}).items()]
        # Modules in Python run in processes with this interpreter; the program of this process is not Slate's.
        if sys.executable:
            os.environ.setdefault("SLATE_PYTHON", sys.executable)
        file = None if record is None else Path(record).absolute()
        self._recording: Path | None = None
        self._agent = SteppedAgent(os.fspath(name), sets, _program(), _examples(), file)

    @property
    def time(self) -> float:
        """Time of the agent, s."""
        return self._agent.state()[0] * 1e-9

    @property
    def cycle(self) -> int:
        """Number of the last cycle; 0 before the first."""
        return self._agent.state()[1]

    @property
    def running(self) -> bool:
        """Whether the mission is in progress."""
        return self._agent.state()[2]

    @property
    def digest(self) -> str:
        """Digest of all values that were written, as in the summary of `slate run`."""
        return self._agent.digest()

    @property
    def result(self) -> dict[str, Any]:
        """Outcome (None before the end), message and figures of the judges."""
        return json.loads(self._agent.result())

    @property
    def recording(self) -> Path | None:
        """File of the recording, once the simulation is closed."""
        return self._recording

    def step(self, cycles: int = 1) -> bool:
        """Makes cycles, at most until the mission ends; returns whether it is in progress.

        Raises `RuntimeError` if the mission has ended before.
        """
        self._agent.step(cycles)
        return self.running

    def run(self) -> dict[str, Any]:
        """Makes cycles until the mission has ended, and returns the result with the digest."""
        while self.running:
            self.step(1 << 20)
        return {**self.result, "time": self.time, "cycles": self.cycle, "digest": self.digest}

    def set(self, changes: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Changes settings, all or none, by paths as `slate run --set` takes them."""
        pairs = [[path, setting(value)] for path, value in changes.items()]
        return json.loads(self._agent.operate("set", [], json.dumps(pairs)))

    def properties(self) -> dict[str, str]:
        """URLs of the properties, each with the name of its interface."""
        return dict(self._agent.properties())

    def probe(self, *fields: str | tuple[str, int]) -> Probe:
        """Numbers of several properties that `drive` and `sample` read at once.

        A field is a URL such as `/simulator/r2/truth/x`, `/r2/sonar/value/echoes/*/range` for each item of a list, or a
        pair of a list and a number of sectors, of each of which the least number is read.
        """
        return self._agent.probe([(field, None) if isinstance(field, str) else field for field in fields])

    def input(self, url: str) -> DrivenInput:
        """Input of numbers that `drive` sets, such as one of velocities; of a recorded simulation before its first cycle."""
        return self._agent.input(url)

    def sample(self, probe: Probe, target: Any) -> None:
        """Reads the newest numbers into an array of float64; NaN where nothing was written."""
        self._agent.sample(probe, target)

    def drive(self, input: DrivenInput, values: list[float], probe: Probe, target: Any) -> bool:
        """Sets an input, makes one cycle and reads numbers; returns whether the mission is in progress."""
        return self._agent.drive(input, values, probe, target)

    def __getitem__(self, url: str) -> SimulatedProperty:
        return SimulatedProperty(self, url if "://" in url or url.startswith("/") else f"/{url}")

    def __iter__(self) -> Iterator[str]:
        return iter(self.properties())

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)

    def close(self) -> None:
        """Ends the agent and its recording."""
        self._recording = self._agent.close() or self._recording

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class SimulatedProperty:
    """Property or field of a simulation, at a URL such as `/simulator/r2/truth/x`."""

    __slots__ = ("_simulation", "_url")

    def __init__(self, simulation: Simulation, url: str) -> None:
        self._simulation, self._url = simulation, url

    @property
    def url(self) -> str:
        """Path of the property."""
        return self._url

    @property
    def value(self) -> Any:
        """Newest value; None before the first write. Setting it sets a parameter or an input without a link."""
        sample = self.read()
        return None if sample is None else sample.value

    @value.setter
    def value(self, value: Any) -> None:
        operation = "patch" if isinstance(value, dict) else "write"
        text = json.dumps(_plain(value), allow_nan=False)
        self._simulation._agent.operate(operation, [("path", self._url)], text)

    def read(self) -> Sample | None:
        """Newest value with its stamp; None before the first write."""
        found = self._simulation._agent.read(self._url)
        if found is None:
            return None
        text, time, sequence = found
        return Sample(json.loads(text), time * 1e-9, sequence)

    def array(self) -> Any:
        """Newest value as an array of numpy: a list of numbers, of messages, an `Image` or an `OccupancyGrid`.

        An image has rows, columns and, in color, red, green and blue; a map has rows from the lowest y.
        """
        numpy = import_numpy()
        value = self._simulation.properties().get(self._url)
        if value == "Image":
            head = {name: self._field(name) for name in ("width", "height", "step")}
            return image_array(numpy, self._numbers(numpy, "data"), **head)
        if value == "OccupancyGrid":
            return grid_array(self._numbers(numpy, "data"), self._field("width"), self._field("height"))
        try:
            return self._numbers(numpy, "")
        except KeyError:
            return record_array(numpy, self._url, self.value)

    def _numbers(self, numpy: Any, field: str) -> Any:
        found = self._simulation._agent.numbers(f"{self._url}/{field}".rstrip("/"))
        if found is None:
            raise ValueError(f"{self._url} has no value yet")
        return numpy.frombuffer(found[1], dtype=found[0])

    def _field(self, name: str) -> Any:
        return (self / name).value

    def __truediv__(self, field: str | int) -> SimulatedProperty:
        return type(self)(self._simulation, f"{self._url.rstrip('/')}/{field}")

    def __repr__(self) -> str:
        return f"<SimulatedProperty {self._url}>"


def _program() -> Path | None:
    """Program that runs isolated modules."""
    from .program import program

    try:
        return program()
    except FileNotFoundError:
        return None


def _examples() -> Path | None:
    """Folder of the examples that are files, as this package has installed them."""
    folder = Path(sysconfig.get_path("data")) / "share/slate/examples"
    return folder if folder.is_dir() else None
