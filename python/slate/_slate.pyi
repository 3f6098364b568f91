"""Connections to agents: the compiled part of the package."""

from os import PathLike

__version__: str

class AgentError(Exception):
    """Error of a request to an agent."""

class NoAgent(AgentError):
    """No agent of that name runs on this computer."""

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
    """Names of the agents that run on this computer."""

def agent_of(process: int) -> str | None:
    """Name of the agent that a process runs; None if it runs none."""
