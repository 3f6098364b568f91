"""Recordings as columns: numpy arrays, data frames of pandas, tables of Arrow."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

from ._slate import RecordingFile
from .arrays import grid_array, image_array, import_numpy


def open_recording(file: str | os.PathLike[str]) -> Recording:
    """Opens the file of a recording, such as `run.mcap` in the folder of a run, or that folder."""
    return Recording(file)


class Recording:
    """Recording of a run; `recording["/simulator/r2/truth"]` has the values of a property."""

    def __init__(self, file: str | os.PathLike[str]) -> None:
        path = Path(file)
        self._path = path / "run.mcap" if path.is_dir() else path
        self._file = RecordingFile(self._path)
        self._info: dict[str, Any] = json.loads(self._file.info())

    @property
    def path(self) -> Path:
        """Path of the file."""
        return self._path

    @property
    def info(self) -> dict[str, Any]:
        """Content of the file, as `slate bag info --json` has it."""
        return self._info

    @cached_property
    def topics(self) -> dict[str, str]:
        """Topics, each with the name of its interface."""
        channels = self._info["channels"]
        return {channel["topic"]: channel["schema"].rpartition("/")[2] for channel in channels}

    def __getitem__(self, url: str) -> Any:
        """Values of a topic as `Topic`; of a field of one, its array, such as `recording["/simulator/r2/truth/x"]`."""
        url = url if url.startswith("/") else f"/{url}"
        if url in self.topics:
            return self.topic(url)
        above = [topic for topic in self.topics if url.startswith(f"{topic}/")]
        if not above:
            import difflib

            near = difflib.get_close_matches(url, self.topics, 3)
            hint = f"did you mean {' or '.join(near)}?" if near else f"it has {len(self.topics)} topics: recording.topics"
            raise KeyError(f"{self._path} has no topic {url}: {hint}")
        topic = max(above, key=len)
        return self.topic(topic)[url[len(topic) + 1 :]]

    def topic(self, url: str, *, start: float | None = None, end: float | None = None) -> Topic:
        """Values of a topic between two times, s after the first message of the file."""
        nanoseconds = [None if time is None else int(time * 1e9) for time in (start, end)]
        times, columns = self._file.table(url, *nanoseconds)
        return Topic(url, self.topics.get(url, ""), times, columns)

    @property
    def configuration(self) -> str:
        """Configuration of the run, as TOML."""
        return self._file.attachment("configuration.toml").decode()

    def __iter__(self) -> Iterator[str]:
        return iter(self.topics)

    def __len__(self) -> int:
        return len(self.topics)

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.topics)

    def __repr__(self) -> str:
        return f"<Recording {self._path}: {self._info['messages']} messages of {len(self.topics)} topics>"


class Topic:
    """Values of a topic as columns: `topic.time`, and an array for each field such as `topic["x"]`.

    A field of a message in a message is `pose/x`. A list is a row of a matrix if it always has the same length, or else
    an array in an array of objects. Names stand for the numbers of enumerations.
    """

    def __init__(self, url: str, interface: str, times: bytes, columns: list[tuple[str, str, Any, list[int] | None]]) -> None:
        numpy = import_numpy()
        self.url, self.interface = url, interface
        self.nanoseconds: Any = numpy.frombuffer(times, dtype="u8")
        """Times of the values, agent time in ns."""
        self._columns = {name: _Column(numpy, *column) for name, *column in columns}

    @cached_property
    def time(self) -> Any:
        """Times of the values, agent time in s."""
        return self.nanoseconds * 1e-9

    @property
    def fields(self) -> list[str]:
        """Names of the fields."""
        return list(self._columns)

    def __getitem__(self, field: str) -> Any:
        """Array of a field; of a message in a message, a dict of arrays."""
        if field in self._columns:
            return self._columns[field].array
        within = {name[len(field) + 1 :]: column.array for name, column in self._columns.items() if name.startswith(f"{field}/")}
        if not within:
            raise KeyError(f"{self.url} has no field {field}; it has {', '.join(self.fields)}")
        return within

    def __len__(self) -> int:
        return len(self.nanoseconds)

    def to_dict(self) -> dict[str, Any]:
        """Arrays by name, with `time`."""
        return {"time": self.time, **{name: column.array for name, column in self._columns.items()}}

    def to_pandas(self) -> Any:
        """Data frame of pandas with the time as its index; a list is an array in a cell."""
        try:
            import pandas
        except ImportError as error:
            raise ImportError("data frames need pandas: pip install 'slate-robotics[pandas]'") from error
        index = pandas.Index(self.time, name="time")
        return pandas.DataFrame({name: column.cells for name, column in self._columns.items()}, index=index)

    def to_arrow(self) -> Any:
        """Table of Arrow, with the column `time` in ns."""
        try:
            import pyarrow
        except ImportError as error:
            raise ImportError("tables of Arrow need pyarrow: pip install 'slate-robotics[arrow]'") from error
        time = pyarrow.array(self.nanoseconds.astype("i8"), type=pyarrow.duration("ns"))
        return pyarrow.table({"time": time, **{name: column.arrow(pyarrow) for name, column in self._columns.items()}})

    def images(self) -> list[Any]:
        """Pixels of each image, of a topic with the interface `Image`."""
        self._check("Image", "images")
        numpy = import_numpy()
        sizes = zip(self["width"], self["height"], self["step"])
        data = self._columns["data"].rows
        return [image_array(numpy, one, width=int(w), height=int(h), step=int(s)) for one, (w, h, s) in zip(data, sizes)]

    def grids(self) -> list[Any]:
        """Cells of each map, of a topic with the interface `OccupancyGrid`."""
        self._check("OccupancyGrid", "maps")
        sizes = zip(self["width"], self["height"])
        return [grid_array(one, int(width), int(height)) for one, (width, height) in zip(self._columns["data"].rows, sizes)]

    def _check(self, interface: str, what: str) -> None:
        if self.interface != interface:
            raise TypeError(f"{self.url} has no {what}: expected the interface {interface}, found {self.interface}")

    def __repr__(self) -> str:
        return f"<Topic {self.url}: {len(self)} x {self.interface} ({', '.join(self.fields)})>"


class _Column:
    """Numbers or texts of one field."""

    def __init__(self, numpy: Any, dtype: str, content: Any, lengths: list[int] | None) -> None:
        self._numpy = numpy
        self._flat = numpy.frombuffer(content, dtype=dtype) if dtype else numpy.array(content, dtype=object)
        self._lengths = lengths

    @cached_property
    def rows(self) -> list[Any]:
        """Part of each message, of a column of lists."""
        ends = self._numpy.cumsum(self._lengths or [], dtype="i8")
        return self._numpy.split(self._flat, ends[:-1]) if len(ends) else []

    @cached_property
    def array(self) -> Any:
        if self._lengths is None:
            return self._flat
        if len(set(self._lengths)) == 1:
            return self._flat.reshape(len(self._lengths), self._lengths[0])
        return self.cells

    @cached_property
    def cells(self) -> Any:
        """One cell for each message."""
        if self._lengths is None:
            return self._flat
        cells = self._numpy.empty(len(self._lengths), dtype=object)
        for row, part in enumerate(self.rows):
            cells[row] = part
        return cells

    def arrow(self, pyarrow: Any) -> Any:
        flat = pyarrow.array(self._flat)
        if self._lengths is None:
            return flat
        offsets = self._numpy.concatenate([[0], self._numpy.cumsum(self._lengths)]).astype("i4")
        return pyarrow.ListArray.from_arrays(pyarrow.array(offsets), flat)
