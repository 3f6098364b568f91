"""Connections to agents, simulations, recordings, and processes of modules: the compiled part of the package."""

from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from .module import Module

__version__: str

class AgentError(Exception):
    """Error of a request to an agent."""

class NoAgent(AgentError):
    """No agent of that name runs on this machine."""

class AgentUnreachable(AgentError):
    """The agent does not answer, or the connection broke."""

class VersionMismatch(AgentError):
    """The agent has another version of the operations."""

class Refused(AgentError):
    """The agent refuses."""

    help: str
    """What to do."""
    code: str | None
    """Code such as `S015`, which `slate explain` describes."""
    report: str | None
    """File, line and caret of mistakes in a configuration."""

class Connection:
    """Connection to an agent; several threads may use it at the same time."""

    @staticmethod
    def local(name: str) -> Connection: ...
    @staticmethod
    def remote(address: str, token: str, certificate: str | PathLike[str] | None = None) -> Connection: ...
    def call(self, method: str, path: str, body: str | None = None) -> str: ...
    def stop(self, reason: str) -> None: ...

def agents() -> list[str]:
    """Names of the agents that run on this machine."""

def agent_of(process: int) -> str | None:
    """Name of the agent that a process runs; None if it runs none."""

class Stamp:
    """Time and number of a value."""

    time: int
    """Agent time of writing, ns."""
    sequence: int
    """Number of the value, from 1; 0 before the first write."""

class Value:
    """Value of an interface during a tick; its fields are attributes, its arrays views of numpy."""

    def __getattr__(self, name: str) -> Any: ...
    def __setattr__(self, name: str, value: Any) -> None: ...
    def __getitem__(self, name: str) -> Any: ...
    def __setitem__(self, name: str, value: Any) -> None: ...
    def to_dict(self) -> dict[str, Any]:
        """Copy of all fields, with lists for arrays."""

class Received:
    """Received value or message; its fields are attributes."""

    def __getattr__(self, name: str) -> Any: ...
    def __getitem__(self, name: str) -> Any: ...
    def value(self) -> Value: ...
    def to_dict(self) -> dict[str, Any]: ...
    def stamp(self) -> Stamp: ...
    def sender(self) -> int:
        """Number of the message's sender."""
    def refuse(self, reason: int) -> None:
        """Refuses the message, with a reason that the interface defines (not 0)."""

class Tick:
    """Time, random numbers and log of a step."""

    def now(self) -> int:
        """Agent time, ns."""
    def seconds(self) -> float:
        """Agent time, s."""
    def elapsed(self) -> float:
        """Time since this module's last tick, s; 0 in the first."""
    def number(self) -> int:
        """Number of the tick, from 1."""
    def unit(self) -> float:
        """Random number uniform in [0, 1), from the module's own stream."""
    def uniform(self, low: float, high: float) -> float:
        """Random number uniform in [low, high)."""
    def normal(self) -> float:
        """Standard normal random number, mean 0 and stddev 1."""
    def bits(self) -> int:
        """64 random bits."""
    def info(self, text: str, **fields: Any) -> None:
        """Logs information for users; fields are read by tools."""
    def warn(self, text: str, **fields: Any) -> None:
        """Logs a problem with which the robot goes on."""
    def error(self, text: str, **fields: Any) -> None:
        """Logs a failure."""

class Fixture:
    """Test fixture of a module, without an agent: set inputs, tick, read outputs."""

    def __init__(self, module: type[Module], **parameters: Any) -> None: ...
    @property
    def module(self) -> Any:
        """The instance, whose state can be read."""
    def set(self, port: str, *value: Any, **fields: Any) -> None:
        """Sets an input: to a dict, or to the fields by their names."""
    def push(self, port: str, *value: Any, **fields: Any) -> None:
        """Puts a message into an inbox, or a value into a queue."""
    def expire(self, port: str) -> None:
        """Makes an input stale, as when its writer stopped."""
    def params(self, **parameters: Any) -> None:
        """Changes parameters, by their names."""
    def advance(self, seconds: float) -> None:
        """Advances the time, s."""
    def waiting_for(self) -> str | None:
        """Name of a required input without a value; None if the module can tick."""
    def tick(self) -> int:
        """Makes one step and returns the number of its outcome; an exception of the step is raised."""
    def output(self, port: str) -> dict[str, Any] | None:
        """Value that the last tick wrote; None if it wrote none."""
    def priority(self, port: str) -> int | None:
        """Priority with which the last tick sent a command; None if it sent none."""
    def sent(self, port: str) -> list[dict[str, Any]]:
        """Messages that the last tick sent."""
    def log(self) -> list[tuple[int, str]]:
        """Lines of the log so far: level (0 for an error, 1 a warning, 2 information) and text."""
    def save(self) -> bytes:
        """State as in a snapshot."""
    def restore(self, state: bytes) -> None:
        """Takes over a saved state."""

def interface(name: str) -> dict[str, Any] | None:
    """Fields of an interface that is well-known or of the agent; None for an unknown name."""

def interfaces() -> set[str]:
    """Names of the interfaces that are well-known or of the agent."""

def encode_value(interface: dict[str, Any], value: dict[str, Any]) -> bytes:
    """Bytes of a value of an interface without a tail."""

def nanoseconds(text: str) -> int | None:
    """Nanoseconds of a duration such as "200ms"; None for other text."""

def is_stage(name: str) -> bool:
    """Returns true if a stage of the main loop has that name."""

def serve_module(load: Callable[[Path, Path], list[type[Module]]]) -> None:
    """Runs a module for the agent that has started this process, until its end."""

class ConfigurationError(Exception):
    """Example or configuration that can't run."""

    help: str | None
    """What to do."""
    report: str | None
    """File, line and caret of mistakes in a configuration."""

class Probe:
    """Numbers of several properties, read at once."""

    @property
    def length(self) -> int:
        """Number of numbers."""

class DrivenInput:
    """Input of numbers that is set in each cycle."""

    @property
    def names(self) -> list[str]:
        """Names of the fields, in order."""

class SteppedAgent:
    """Agent in lockstep that runs in this process, one cycle at a time."""

    def __init__(
        self,
        name: str,
        sets: Sequence[str],
        program: PathLike[str] | None = None,
        examples: PathLike[str] | None = None,
        recording: PathLike[str] | None = None,
    ) -> None: ...
    def step(self, cycles: int) -> int: ...
    def drive(self, input: DrivenInput, values: Sequence[float], probe: Probe, target: Any) -> bool: ...
    def probe(self, fields: Sequence[tuple[str, int | None]]) -> Probe: ...
    def sample(self, probe: Probe, target: Any) -> None: ...
    def input(self, url: str) -> DrivenInput: ...
    def read(self, url: str) -> tuple[str, int, int] | None: ...
    def numbers(self, url: str) -> tuple[str, bytes] | None: ...
    def operate(self, name: str, parts: list[tuple[str, str]], body: str) -> str: ...
    def properties(self) -> list[tuple[str, str]]: ...
    def state(self) -> tuple[int, int, bool]: ...
    def digest(self) -> str: ...
    def result(self) -> str: ...
    def close(self) -> Path | None: ...

class RecordingFile:
    """File of a recording."""

    def __init__(self, path: PathLike[str]) -> None: ...
    def info(self) -> str: ...
    def table(
        self, topic: str, start: int | None = None, end: int | None = None
    ) -> tuple[bytes, list[tuple[str, str, bytes | list[str], list[int] | None]]]: ...
    def attachment(self, name: str) -> bytes: ...
