"""Client of an agent."""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ._slate import AgentError, Connection, NoAgent, Refused, agents
from .property import Property, Sample, _plain, _sample
from .settings import setting


def connect(name: str | None = None, *, token: str | None = None, certificate: str | os.PathLike[str] | None = None) -> Agent:
    """Connects to an agent.

    `name` is that of an agent of this machine, or an address such as `https://robot.local:7878`; without one it is
    that in the variable SLATE_AGENT, or the only agent that runs. `token` is the secret of a role for an address
    (default: the variable SLATE_TOKEN), `certificate` the file of the certificates to trust.

    Raises `NoAgent`, `AgentUnreachable`, `VersionMismatch`, or `Refused` for an invalid token.
    """
    name = name or os.environ.get("SLATE_AGENT") or _only_agent()
    if "://" not in name:
        return Agent(Connection.local(name))
    secret = token or os.environ.get("SLATE_TOKEN", "")
    return Agent(Connection.remote(name, secret, certificate))


def _only_agent() -> str:
    running = agents()
    if len(running) == 1:
        return running[0]
    if not running:
        raise NoAgent("no agent runs here: start one with `slate run exp1`")
    raise NoAgent(f"several agents run here: name one of {', '.join(running)}")


class Agent:
    """Running agent; `agent["/localizer/pose"]` is a property."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._name: str = self.call("GET", "/agent")["name"]

    @property
    def name(self) -> str:
        """Name that the agent gives itself."""
        return self._name

    def call(self, method: str, path: str, body: Any = None) -> Any:
        """Carries out an operation of the HTTP API, such as `call("GET", "/modules")`; the answer is that of JSON."""
        text = None if body is None else json.dumps(body, allow_nan=False)
        return json.loads(self._connection.call(method, path, text) or "null")

    # Properties.

    def __getitem__(self, url: str) -> Property:
        return Property(self, url if "://" in url or url.startswith("/") else f"/{url}")

    def properties(self, pattern: str | None = None) -> list[dict[str, Any]]:
        """Properties with path, interface and documentation, all or those of a pattern such as `/r2/**`."""
        return self.call("GET", "/properties" + (f"?pattern={_coded(pattern)}" if pattern else ""))

    def __iter__(self) -> Iterator[str]:
        return iter([_url(entry) for entry in self.properties()])

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)

    def watch(self, *urls: str, timeout: float | None = None) -> Iterator[tuple[str, Sample]]:
        """Iterator over the values of several properties as they come, each with its URL."""
        after: dict[str, int | None] = dict.fromkeys(urls)
        until = _until(timeout)
        while True:
            for index, sample in self._ask_for_news([(url, after[url]) for url in urls], _rest(until, 5.0)):
                until = _until(timeout)
                after[urls[index]] = sample.sequence
                yield urls[index], sample
            if until is not None and time.monotonic() >= until:
                raise TimeoutError(f"no value of {', '.join(urls)} within {timeout} s")

    # Modules and links.

    def modules(self) -> list[dict[str, Any]]:
        """Modules with their kind and condition."""
        return self.call("GET", "/modules")

    def enable(self, module: str) -> None:
        """Switches a module on."""
        self.call("PUT", f"/modules/{_coded(module)}", {"enabled": True})

    def disable(self, module: str) -> None:
        """Switches a module off."""
        self.call("PUT", f"/modules/{_coded(module)}", {"enabled": False})

    def links(self) -> list[dict[str, Any]]:
        """Links of inputs and inboxes."""
        return self.call("GET", "/links")

    def link(self, to: str | Property, source: str | Property, **options: Any) -> None:
        """Links an input to a property, or adds a sender to an inbox."""
        pairs = [[key, str(value)] for key, value in options.items()]
        self.call("PUT", f"/links/{_coded(_path(to))}", {"from": _path(source), "options": pairs})

    def unlink(self, to: str | Property, source: str | Property | None = None) -> None:
        """Removes the link of an input, or one sender of an inbox."""
        sender = "" if source is None else f"?from={_coded(_path(source))}"
        self.call("DELETE", f"/links/{_coded(_path(to))}{sender}")

    # Settings.

    def settings(self, path: str = "") -> dict[str, Any]:
        """Settings of the configuration at a path and below it."""
        return {entry["path"]: entry["value"] for entry in self.call("GET", f"/settings?path={_coded(path)}")}

    def set(self, changes: dict[str, Any]) -> list[dict[str, Any]]:
        """Changes settings, all or none, by paths as `slate run --set` takes them."""
        pairs = [[path, setting(value)] for path, value in changes.items()]
        return self.call("PATCH", "/settings", pairs)

    def revert(self, path: str = "") -> None:
        """Reverts changes that were made at run time, at a path and below it."""
        self.call("DELETE", f"/settings?path={_coded(path)}")

    # Motion.

    def stop(self, reason: str = "from Python") -> None:
        """Stops all actuators until `reset` and `arm`, also of an agent that hangs."""
        self._connection.stop(reason)

    def reset(self) -> bool:
        """Ends a stop; False if nothing was stopped. Actuators stay disarmed until `arm`."""
        return self.call("POST", "/reset")["was_stopped"]

    def arm(self, actuator: str | None = None) -> None:
        """Arms all actuators, or one."""
        self.call("POST", "/arm", {"actuator": actuator})

    @contextmanager
    def drive(self, actuator: str, who: str = "Python") -> Iterator[Lease]:
        """Control lease of an actuator, renewed until the block ends: its commands go before the plan's.

        Without a command that is repeated within `Lease.hold` seconds, the actuator takes its safe value.
        """
        answer = self.call("POST", "/leases", {"actuator": actuator, "who": who})
        lease = Lease(self, answer)
        ended = threading.Event()
        renewal = threading.Thread(target=lease._renew, args=(ended,), name=f"lease of {actuator}", daemon=True)
        renewal.start()
        failed = True
        try:
            yield lease
            failed = False
        finally:
            ended.set()
            renewal.join()
            # A lease that has ended needs no release; an error of the block goes before one of the release.
            with suppress(AgentError if failed else Refused):
                lease.release()

    # Recordings, snapshots, the log.

    @contextmanager
    def record(self, file: str | os.PathLike[str], *patterns: str, rate: float | None = None, on_change: bool = False) -> Iterator[Path]:
        """Records into a new file while the block lasts: all properties, or those of patterns."""
        path = Path(file).absolute()
        wish = {"select": list(patterns), "exclude": [], "rate": rate, "on_change": on_change}
        self.call("POST", f"/recordings/{_coded(str(path))}", wish)
        try:
            yield path
        finally:
            self.call("POST", f"/recordings/{_coded(str(path))}/stop")

    def snapshot(self, file: str | os.PathLike[str]) -> dict[str, Any]:
        """Saves the state of all modules into a file."""
        return self.call("POST", f"/snapshots/{_coded(str(Path(file).absolute()))}")

    def resume(self, file: str | os.PathLike[str]) -> dict[str, Any]:
        """Continues from a snapshot."""
        return self.call("POST", f"/snapshots/{_coded(str(Path(file).absolute()))}/load")

    def log(self, text: str) -> None:
        """Writes a line into the agent's log, which each recording has."""
        self.call("POST", "/log", {"text": text})

    def __repr__(self) -> str:
        return f"<Agent {self._name}>"

    # For properties.

    def _place(self, url: str) -> str:
        agent, _, path = url.removeprefix("slate://").partition("/") if url.startswith("slate://") else (self._name, "", url)
        return f"{_coded(agent)}/{_coded(path.lstrip('/'))}"

    def _ask_for_news(self, of: list[tuple[str, int | None]], within: float) -> Iterator[tuple[int, Sample]]:
        body = {"of": [{"url": url, "after": after} for url, after in of], "within": int(within * 1000)}
        for news in self.call("POST", "/watch", body):
            for number, reading in enumerate(news["readings"]):
                yield news["of"], _sample(reading, news["missed"] if number == 0 else 0)

    def _look(self, url: str, after: int | None, within: float) -> list[Sample]:
        return [sample for _, sample in self._ask_for_news([(url, after)], within)]

    def _news(self, url: str, after: int | None, timeout: float | None, wait: float) -> list[Sample]:
        """Next values, at least one."""
        until = _until(timeout)
        while True:
            news = self._look(url, after, _rest(until, wait))
            if news:
                return news
            if until is not None and time.monotonic() >= until:
                raise TimeoutError(f"no value of {url} within {timeout} s")


class Lease:
    """Control lease of an actuator."""

    def __init__(self, agent: Agent, answer: dict[str, Any]) -> None:
        self._agent, self._lease = agent, answer["lease"]
        self.actuator: str = answer["actuator"]
        """Actuator that it is for."""
        self.interface: dict[str, Any] = answer["interface"]
        """JSON Schema of its commands."""
        self.hold: float = answer["hold_ms"] / 1000
        """Time after which a command that is not repeated ends, s."""
        self._term: float = answer["term_ms"] / 1000

    def command(self, command: Any, seconds: float = 0.0) -> Any:
        """Commands the actuator for `hold` seconds, or repeats the command for `seconds`; returns the state of its gate."""
        until = time.monotonic() + seconds
        while True:
            gate = self._agent.call("PUT", f"/leases/{_coded(self._lease)}", {"command": _plain(command)})["gate"]
            rest = until - time.monotonic()
            if rest <= self.hold:
                return gate
            time.sleep(self.hold / 3)

    def _renew(self, ended: threading.Event) -> None:
        while not ended.wait(self._term / 4):
            # The next command reports the error.
            with suppress(AgentError):
                self._agent.call("PUT", f"/leases/{_coded(self._lease)}", {})

    def release(self) -> None:
        """Gives the lease back; the plan commands again."""
        self._agent.call("DELETE", f"/leases/{_coded(self._lease)}")


def _coded(text: str) -> str:
    return quote(text, safe="-_.~")


def _path(place: str | Property) -> str:
    return place.url if isinstance(place, Property) else place


def _url(entry: dict[str, Any]) -> str:
    return entry["path"] if "://" in entry["path"] or entry["path"].startswith("/") else f"/{entry['path']}"


def _until(timeout: float | None) -> float | None:
    return None if timeout is None else time.monotonic() + timeout


def _rest(until: float | None, wait: float) -> float:
    return wait if until is None else max(0.0, min(wait, until - time.monotonic()))
