"""Slate: a robot software framework; this package is its program, a client of its agents, and modules in Python.

>>> agent = slate.connect("exp1")
>>> agent["/simulator/r2/truth"].value
{'x': -0.44, 'y': 1.46, 'theta': -1.79}
"""

from ._slate import (
    AgentError,
    AgentUnreachable,
    ConfigurationError,
    Fixture,
    NoAgent,
    Received,
    Refused,
    Stamp,
    Tick,
    Value,
    VersionMismatch,
    __version__,
    agents,
)
from .agent import Agent, Lease, connect
from .module import (
    Command,
    Debug,
    Field,
    Inbox,
    Input,
    Interface,
    Module,
    Outbox,
    Outcome,
    Output,
    Parameter,
    Priority,
    Queue,
    Required,
    Setup,
)
from .property import Property, Sample
from .program import BatchTable, ProgramError, RunResult, batch, program, run, start
from .recording import Recording, Topic, open_recording
from .simulation import SimulatedProperty, Simulation

__all__ = [
    "Agent",
    "AgentError",
    "AgentUnreachable",
    "BatchTable",
    "Command",
    "ConfigurationError",
    "Debug",
    "Field",
    "Fixture",
    "Inbox",
    "Input",
    "Interface",
    "Lease",
    "Module",
    "NoAgent",
    "Outbox",
    "Outcome",
    "Output",
    "Parameter",
    "Priority",
    "ProgramError",
    "Property",
    "Queue",
    "Received",
    "Recording",
    "Refused",
    "Required",
    "RunResult",
    "Sample",
    "Setup",
    "SimulatedProperty",
    "Simulation",
    "Stamp",
    "Tick",
    "Topic",
    "Value",
    "VersionMismatch",
    "__version__",
    "agents",
    "batch",
    "connect",
    "open_recording",
    "program",
    "run",
    "start",
]
