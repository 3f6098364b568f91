"""Properties of an agent: values that are read, watched, set, and inboxes that take messages."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

from .arrays import import_numpy, record_array

if TYPE_CHECKING:
    from .agent import Agent

#: Longest wait of one request for news, s. A signal such as Ctrl-C does not wait for its end.
WAIT = 5.0
#: The same where a task of asyncio may be canceled meanwhile, s.
ASYNC_WAIT = 0.5


@dataclass(frozen=True, slots=True)
class Sample:
    """Value with its stamp."""

    value: Any
    """Value: a number, a text, a list, or a dict of fields; infinity and NaN are None."""
    time: float
    """Agent time of the write, s."""
    sequence: int
    """Number of the write, from 1."""
    missed: int = 0
    """Values between this one and the one before that the reader has not seen."""


class Property:
    """Property or field at a URL of an agent, such as `/localizer/pose/x`."""

    __slots__ = ("_agent", "_url")

    def __init__(self, agent: Agent, url: str) -> None:
        self._agent, self._url = agent, url

    @property
    def url(self) -> str:
        """Path of the property, or `slate://agent/path`."""
        return self._url

    @property
    def value(self) -> Any:
        """Newest value; None before the first write. Setting it sets a parameter or an input without a link."""
        sample = self.read()
        return None if sample is None else sample.value

    @value.setter
    def value(self, value: Any) -> None:
        self.set(value)

    def read(self) -> Sample | None:
        """Newest value with its stamp; None before the first write."""
        reading = self._agent.call("GET", self._place("slate"))
        return _sample(reading) if reading["sequence"] else None

    def array(self, dtype: Any = None) -> Any:
        """Newest value as a numpy array, for lists; None (null) becomes NaN.

        A list of numbers becomes an array of them, a list of dicts an array with a column for each field:
        `agent["/r2/sonar/value/echoes"].array()["range"]`.
        """
        return record_array(import_numpy(), self._url, self.value, dtype)

    def set(self, value: Any) -> None:
        """Sets a parameter, an input without a link, or one of their fields; a dict sets the fields that it names."""
        method = "PATCH" if isinstance(value, dict) else "PUT"
        self._agent.call(method, self._place("slate"), _plain(value))

    def send(self, message: Any, *, dry_run: bool = False) -> str:
        """Sends a message to an inbox, and returns what became of it, such as `done`."""
        path = self._place("slate") + ("?dry_run=true" if dry_run else "")
        return self._agent.call("POST", path, _plain(message))["status"]

    def history(self) -> list[Sample]:
        """Values that the property keeps, the oldest first."""
        return [_sample(reading) for reading in self._agent.call("GET", self._place("queues") + "?limit=100000")["values"]]

    def schema(self) -> dict[str, Any]:
        """JSON Schema of the property's interface, with units."""
        found = self._agent.properties(self._url)
        if not found:
            raise KeyError(self._url)
        return self._agent.call("GET", f"/interfaces/{found[0]['interface']}")

    def watch(self, *, timeout: float | None = None) -> Iterator[Sample]:
        """Iterator over values as they come, from the newest one on.

        A reader that is too slow for a property that keeps one value misses values, and `Sample.missed` counts them.
        Ends with `TimeoutError` when no value comes for `timeout` seconds.
        """
        after = None
        while True:
            for sample in self._agent._news(self._url, after, timeout, WAIT):
                after = sample.sequence
                yield sample

    def wait(self, condition: Any = None, *, timeout: float | None = None) -> Sample:
        """Waits for a value that fulfils a condition, such as `lambda pose: pose["x"] > 1`; without one, for any value."""
        until = None if timeout is None else time.monotonic() + timeout
        late = f"no value of {self._url} fulfils the condition within {timeout} s"
        after = None
        while True:
            rest = None if until is None else max(0.0, until - time.monotonic())
            try:
                news = self._agent._news(self._url, after, rest, WAIT)
            except TimeoutError:
                raise TimeoutError(late) from None
            for sample in news:
                after = sample.sequence
                if condition is None or condition(sample.value):
                    return sample
            # Values may come faster than they are looked at.
            if until is not None and time.monotonic() > until:
                raise TimeoutError(late)

    def __iter__(self) -> Iterator[Sample]:
        return self.watch()

    async def __aiter__(self) -> AsyncIterator[Sample]:
        after = None
        while True:
            news = await asyncio.to_thread(self._agent._look, self._url, after, ASYNC_WAIT)
            for sample in news:
                after = sample.sequence
                yield sample

    def link(self, source: str | Property, **options: Any) -> None:
        """Links this input to a property; options are those of the link's table, such as `rate="10 Hz"`."""
        self._agent.link(self, source, **options)

    def unlink(self) -> None:
        """Removes the link of this input, or all links of this inbox."""
        self._agent.unlink(self)

    def __truediv__(self, field: str | int) -> Self:
        """Field or element of this property: `agent["/laser/scan"] / "ranges" / 0`."""
        return type(self)(self._agent, f"{self._url.rstrip('/')}/{field}")

    def __repr__(self) -> str:
        try:
            sample = self.read()
        except Exception as error:  # a representation never fails
            return f"<Property {self._url}: {str(error).splitlines()[0]}>"
        text = "no value yet" if sample is None else _short(sample.value)
        return f"<Property {self._url} = {text}>"

    def _place(self, kind: str) -> str:
        return f"/{kind}/{self._agent._place(self._url)}"


def _sample(reading: dict[str, Any], missed: int = 0) -> Sample:
    return Sample(reading["value"], reading["time"] * 1e-9, reading["sequence"], missed)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 200 else text[:197] + "..."


def _plain(value: Any) -> Any:
    """The value without types of numpy."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value
