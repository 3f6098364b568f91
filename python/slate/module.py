"""Modules in Python: ports, parameters, state and a step, declared in a class as in Rust.

>>> class Follower(slate.Module, stage="Act", deadline="5ms"):
...     '''Drives along x to its target.'''
...     pose = slate.Required("Pose2", stale_after="200ms")
...     motion = slate.Output("Twist2")
...     gain = slate.Parameter(0.8, range=(0.0, 5.0), unit="1/s", doc="gain on the distance")
...     steps: int = 0
...     def tick(self, now):
...         self.steps += 1
...         self.motion.set(linear=-self.gain * self.pose.x, angular=0.0)
"""

from __future__ import annotations

import copy
import difflib
import enum
import hashlib
import importlib.util
import inspect
import random
import re
import sys
from typing import TYPE_CHECKING, Any, Callable, Iterator, NamedTuple

from . import _slate
from ._slate import Stamp, Tick, Value

if TYPE_CHECKING:
    from ._slate import Received


class Outcome(enum.IntEnum):
    """Outcome of a tick; None counts as OK."""

    OK = 0
    """Intended result."""
    DEGRADED = 1
    """Degraded result, such as with a stale input."""
    FAILED = 2
    """Failure; its outputs are dropped, and outputs with a safe value take that."""


class Priority(enum.IntEnum):
    """Command priority of an actuator; the highest wins."""

    PLAN = 1
    TELEOPERATION = 2
    REFLEX = 3


class Setup(NamedTuple):
    """Setup of a module: name in the agent, seed of the run, period of the main loop in ns."""

    name: str
    seed: int
    period: int


class Field:
    """Field of an interface.

    Its type is written as in Rust: "f64", "bool", "Text<32>", "[f64; 3]", "Sequence<f64, 8>", "Optional<u32>",
    "[f32]" for a tail, or another interface.
    """

    def __init__(self, type: str | _Interface, *, unit: str = "", doc: str = "") -> None:
        self.type, self.unit, self.doc = type, unit, doc


class Interface:
    """Interface of its own: a class with a `Field` for each field.

    >>> class Battery(slate.Interface):
    ...     '''State of the batteries.'''
    ...     voltage = slate.Field("f64", unit="V", doc="Voltage at the terminals.")
    """

    _table: dict[str, Any]

    def __init_subclass__(cls) -> None:
        fields = [
            {"name": name, "doc": field.doc, "unit": field.unit, "kind": _kind(field.type)}
            for name, field in vars(cls).items()
            if isinstance(field, Field)
        ]
        cls._table = {"name": cls.__name__, "doc": _doc(cls), "fields": fields}


_Interface = type[Interface]

_PRIMITIVES = ("bool", "u8", "u16", "u32", "u64", "i8", "i16", "i32", "i64", "f32", "f64")
_NUMBER = r"(.+?)\s*[,;]\s*([0-9_]+)"
_TYPES = (
    (re.compile(r"Text<\s*([0-9_]+)\s*>"), lambda length: {"text": int(length)}),
    (re.compile(rf"Sequence<\s*{_NUMBER}\s*>"), lambda item, count: {"sequence": [_kind(item), int(count)]}),
    (re.compile(r"Optional<\s*(.+?)\s*>"), lambda item: {"optional": _kind(item)}),
    (re.compile(rf"\[\s*{_NUMBER}\s*\]"), lambda item, count: {"array": [_kind(item), int(count)]}),
    (re.compile(r"\[\s*(.+?)\s*\]"), lambda item: {"tail": _kind(item)}),
)


def _kind(type: str | _Interface) -> Any:
    """Returns a type as in a description of a module."""
    if not isinstance(type, str):
        return {"nested": _interface(type)}
    if type == "Bool" or type in _PRIMITIVES:
        return type.lower()
    for pattern, kind in _TYPES:
        if match := pattern.fullmatch(type.strip()):
            return kind(*match.groups())
    return {"nested": _interface(type)}


def _interface(interface: str | _Interface) -> dict[str, Any]:
    """Returns an interface with its fields, by its name or its class."""
    if isinstance(interface, str):
        # Names may have their crate before them, as in Rust.
        name = interface.rsplit("::", 1)[-1]
        if (table := _slate.interface(name)) is not None:
            return table
        near = difflib.get_close_matches(name, sorted(_slate.interfaces()), 3)
        help = f"did you mean {' or '.join(near)}?" if near else "declare it as a class of slate.Interface"
        raise ValueError(f"no interface `{name}` is known: {help}")
    if isinstance(interface, type) and issubclass(interface, Interface):
        return interface._table
    raise TypeError(f"expected the name of an interface or a class of slate.Interface, found {interface!r}")


def _doc(cls: type) -> str:
    return (cls.__doc__ or "").strip()


def _duration(text: str | None, what: str) -> int | None:
    if text is None:
        return None
    duration = _slate.nanoseconds(text) if isinstance(text, str) else None
    if duration is None:
        raise ValueError(f'{what}: expected a duration such as "200ms", found {text!r}')
    return duration


class _Port:
    """Declaration of a port; a module's instance has the port itself under its name."""

    _direction = ""
    _required = False

    def __init__(self, interface: str | _Interface, *, doc: str = "", role: str = "", **options: Any) -> None:
        self._interface = _interface(interface)
        self._options = {"doc": doc, "role": role, **options}

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Module | None, owner: type | None = None) -> Any:
        return self if instance is None else instance._ports[self._name]

    def __set__(self, instance: Module, value: object) -> None:
        raise AttributeError(f"`{self._name}` is a port: an output is written by `set`, a command by `send`")

    def _description(self) -> dict[str, Any]:
        options = {name: value for name, value in self._options.items() if value is not None}
        if "safe" in options:
            options["safe"] = list(_slate.encode_value(self._interface, options["safe"]))
        if "stale_after" in options:
            options["stale_after"] = _duration(options["stale_after"], f"stale_after of `{self._name}`")
        own = {"name": self._name, "direction": self._direction, "required": self._required}
        return own | {"interface": self._interface} | options


class Input(_Port):
    """Reads the newest value of the linked property, which may be missing at first."""

    _direction = "Input"

    def __init__(
        self, interface: str | _Interface, *, stale_after: str | None = None, doc: str = "", role: str = ""
    ) -> None:
        super().__init__(interface, doc=doc, role=role, stale_after=stale_after)

    if TYPE_CHECKING:

        def get(self) -> Value | None:
            """Newest value of any age; None before the first write."""

        def fresh(self) -> Value | None:
            """Newest value unless it is stale."""

        def updated(self) -> Value | None:
            """Newest value if it was written since this module's last tick."""

        def is_new(self) -> bool: ...
        def is_stale(self) -> bool: ...
        def has_writer(self) -> bool: ...
        def stamp(self) -> Stamp: ...
        def missed(self) -> int: ...


class Required(Input):
    """Input without whose first value the module does not run; its fields are attributes."""

    _required = True

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...
        def __getitem__(self, name: str) -> Any: ...


class Queue(_Port):
    """Reads every value, in order."""

    _direction = "Queue"

    def __init__(
        self, interface: str | _Interface, *, window: int | None = None, doc: str = "", role: str = ""
    ) -> None:
        super().__init__(interface, doc=doc, role=role, window=window)

    if TYPE_CHECKING:

        def __len__(self) -> int: ...
        def __iter__(self) -> Iterator[Received]: ...
        def missed(self) -> int: ...


class Output(_Port):
    """Writes a property, as its only writer."""

    _direction = "Output"

    def __init__(
        self,
        interface: str | _Interface,
        *,
        safe: dict[str, Any] | None = None,
        capacity: int | None = None,
        doc: str = "",
        role: str = "",
    ) -> None:
        super().__init__(interface, doc=doc, role=role, safe=safe, capacity=capacity)

    if TYPE_CHECKING:
        capacity: int

        def set(self, *value: Value | dict[str, Any], **fields: Any) -> None:
            """Writes the property: a value, a dict, or the fields by their names."""

        def write(self, items: int = 0) -> Value:
            """Begins a value that is filled in place; it begins all zero."""


class Debug(_Port):
    """Writes a property only while somebody reads it."""

    _direction = "Debug"

    def __init__(
        self, interface: str | _Interface, *, capacity: int | None = None, doc: str = "", role: str = ""
    ) -> None:
        super().__init__(interface, doc=doc, role=role, capacity=capacity)

    if TYPE_CHECKING:

        def set(self, compute: Callable[[], Value | dict[str, Any]]) -> None: ...
        def write(self, items: int = 0) -> Value | None: ...


class Command(_Port):
    """Commands an actuator, through the gate."""

    _direction = "Command"

    def __init__(self, interface: str | _Interface, *, doc: str = "", role: str = "") -> None:
        super().__init__(interface, doc=doc, role=role)

    if TYPE_CHECKING:

        def send(
            self, *value: Value | dict[str, Any], priority: Priority = Priority.PLAN, **fields: Any
        ) -> None: ...


class Inbox(_Port):
    """Receives messages, in the order of each sender."""

    _direction = "Inbox"

    def __init__(
        self, interface: str | _Interface, *, window: int | None = None, doc: str = "", role: str = ""
    ) -> None:
        super().__init__(interface, doc=doc, role=role, window=window)

    if TYPE_CHECKING:

        def __len__(self) -> int: ...
        def __iter__(self) -> Iterator[Received]: ...


class Outbox(_Port):
    """Sends messages to the linked inbox."""

    _direction = "Outbox"

    def __init__(
        self, interface: str | _Interface, *, window: int | None = None, doc: str = "", role: str = ""
    ) -> None:
        super().__init__(interface, doc=doc, role=role, window=window)

    if TYPE_CHECKING:

        def send(self, *value: Value | dict[str, Any], **fields: Any) -> int | None: ...
        def delivery(self, number: int) -> str | int: ...


class Parameter:
    """Parameter of a module: set by configuration, and by users at run time.

    Its type is that of the default: f64, i64, bool or Text<60>; `type` names another one.
    """

    def __init__(
        self,
        default: Any,
        *,
        range: tuple[float, float] | None = None,
        unit: str = "",
        doc: str = "",
        type: str | None = None,
        follows: tuple[str, ...] = (),
    ) -> None:
        known = {bool: "bool", int: "i64", float: "f64", str: "Text<60>"}
        self._type = type or known.get(default.__class__)
        if self._type is None:
            raise TypeError(f"name the `type` of a parameter with the default {default!r}, such as \"[f64; 3]\"")
        self._default, self._range = default, range
        self._field = {"unit": unit, "doc": doc, "kind": _kind(self._type)}
        self._follows = list(follows)

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Module | None, owner: type | None = None) -> Any:
        return self if instance is None else instance._parameters[self._name]

    def __set__(self, instance: Module, value: object) -> None:
        raise AttributeError(f"`{self._name}` is a parameter, which the configuration sets")

    def _description(self) -> dict[str, Any]:
        bounds = None if self._range is None else [float(bound) for bound in self._range]
        return {"name": self._name, "default": self._default, "range": bounds, "follows": self._follows}


class Module:
    """Module: a class with ports, parameters, state and `tick`.

    Its state are the attributes with an annotation and a value, `steps: int = 0`, which the host saves, restores and
    carries over a reload. Attributes with a leading underscore are not saved; `create` makes them.
    """

    _ports: dict[str, Any]
    _parameters: dict[str, Any]
    _kind: dict[str, Any]
    _state: dict[str, Any] = {}

    def __init_subclass__(
        cls,
        *,
        stage: str | None = None,
        on: str | tuple[str, ...] | list[str] = (),
        every: str | None = None,
        timeout: str | None = None,
        deadline: str | None = None,
        name: str | None = None,
        unique: str = "",
    ) -> None:
        cls._state = dict(cls._state)
        for own in _annotations(cls):
            # An annotated port is a port.
            if own.startswith("_") or isinstance(vars(cls).get(own), (_Port, Parameter)):
                continue
            if own not in vars(cls):
                raise TypeError(f"the state `{own}` of {cls.__name__} needs a first value: `{own}: int = 0`")
            cls._state[own] = vars(cls)[own]
        if stage is None:
            return  # A base of modules, and none itself.
        if not _slate.is_stage(stage):
            raise ValueError(
                f"unknown stage `{stage}` of {cls.__name__}: expected PreLoop, SensorAcquire, SensorPrepare, "
                "SensorProcess, WorldState, Think, Skill, Act, ActExec or PostLoop"
            )
        if cls.tick is Module.tick:
            raise TypeError(f"{cls.__name__} has no `def tick(self, now)`")
        if cls.__init__ is not object.__init__:
            raise TypeError(f"{cls.__name__} has an `__init__`, which is not called: use `def create(self, setup)`")
        ports = [on] if isinstance(on, str) else list(on)
        if every is not None and ports:
            raise TypeError(f"{cls.__name__} has `every` and `on`: a module has one trigger")
        if timeout is not None and not ports:
            raise TypeError(f"{cls.__name__} has a `timeout` without `on`, whose longest wait it is")
        trigger: Any = "Stage"
        if every is not None:
            trigger = {"Every": _duration(every, "every")}
        elif ports:
            trigger = {"On": {"ports": ports, "timeout": _duration(timeout, "timeout")}}
        declared = {name: value for base in reversed(cls.__mro__) for name, value in vars(base).items()}
        parameters = [value for value in declared.values() if isinstance(value, Parameter)]
        fields = [{"name": parameter._name, **parameter._field} for parameter in parameters]
        cls._kind = {
            "name": name or re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", cls.__name__).lower(),
            "doc": _doc(cls),
            "description": {
                "stage": stage,
                "ports": [port._description() for port in declared.values() if isinstance(port, _Port)],
                "params": {"name": f"{cls.__name__}Params", "fields": fields},
                "parameters": [parameter._description() for parameter in parameters],
                "trigger": trigger,
                "deadline": _duration(deadline, "deadline"),
                "unique": unique,
            },
        }

    def create(self, setup: Setup) -> None:
        """Prepares the module before its first tick; an exception refuses its parameters."""

    def tick(self, now: Tick) -> Outcome | None:
        """Makes one step."""
        raise NotImplementedError

    def may_unload(self) -> str | None:
        """Returns the reason why the module can't be unloaded now; None if it can."""
        return None

    def __setattr__(self, name: str, value: Any) -> None:
        if name in self._state or name.startswith("_") or isinstance(getattr(type(self), name, None), (_Port, Parameter)):
            object.__setattr__(self, name, value)
            return
        raise AttributeError(
            f"{type(self).__name__} declares no state `{name}`: write `{name}: TYPE = VALUE` in the class to save it, "
            f"or `self._{name}` for what is not saved"
        )

    @classmethod
    def _declared(cls) -> dict[str, Any]:
        return cls._kind

    @classmethod
    def _start(
        cls, ports: dict[str, Any], parameters: dict[str, Any], name: str, seed: int, period: int
    ) -> Module:
        """Makes an instance for the host."""
        # The same in each run, and another stream in each module; a snapshot does not have their state.
        _seed_random(f"{seed} {name}")
        module = cls.__new__(cls)
        module._ports, module._parameters = ports, parameters
        for state, value in cls._state.items():
            setattr(module, state, copy.deepcopy(value))
        module.create(Setup(name, seed, period))
        return module

    def _save(self) -> dict[str, Any]:
        return {name: _packed(_plain(name, first, getattr(self, name))) for name, first in self._state.items()}

    def _restore(self, state: Any) -> None:
        if not isinstance(state, dict):
            raise ValueError("it is not a table")
        values = {}
        for name, first in self._state.items():
            if name not in state:
                raise ValueError(f"it has no `{name}`")
            values[name] = _typed(name, first, _unpacked(state[name]))
        for name, value in values.items():
            setattr(self, name, value)


def _annotations(cls: type) -> dict[str, Any]:
    """Returns the annotations of a class alone, without those of its bases."""
    if sys.version_info >= (3, 14):
        import annotationlib

        # They are evaluated when they are read, and may name what is declared later.
        return annotationlib.get_annotations(cls, format=annotationlib.Format.FORWARDREF)
    return inspect.get_annotations(cls)


def _seed_random(text: str) -> None:
    """Seeds the generators of `random` and of `numpy.random`, if numpy is installed."""
    random.seed(text)
    # One that a module imports later would begin with a seed of the system.
    if importlib.util.find_spec("numpy") is None:
        return
    try:
        import numpy
    except ImportError:
        return
    numpy.random.seed(int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big"))


def _is_named(value: Any) -> bool:
    return isinstance(value, tuple) and hasattr(value, "_fields")


def _is_scalar(value: Any) -> bool:
    """Returns true for a number of numpy."""
    numpy = sys.modules.get("numpy")
    return numpy is not None and isinstance(value, numpy.generic) and value.dtype.names is None


def _wrong(name: str, first: Any, value: Any) -> ValueError:
    expected = "a plain value" if first is None else type(first).__name__
    return ValueError(f"`{name}`: expected {expected}, found {type(value).__name__}")


def _plain(name: str, first: Any, value: Any) -> Any:
    """Returns a state to be saved in a plain type.

    A state that could not be restored is refused, so that a snapshot fails and not its use.
    """
    plain = value.item() if _is_scalar(value) else value
    if isinstance(value, enum.Enum) or _is_named(value):
        if type(value) is type(first):
            plain = value.value if isinstance(value, enum.Enum) else tuple(value)
        elif type(first) in (int, str) and isinstance(value, type(first)):
            plain = type(first)(value)
        else:
            raise _wrong(name, first, value)
    _typed(name, first, plain)
    return plain


def _typed(name: str, first: Any, value: Any) -> Any:
    """Returns a plain value in the type of a state's first value; None is of every type."""
    kind = type(first)
    if first is None or value is None or type(value) is kind:
        return value
    if kind is float and type(value) is int:
        return float(value)
    try:
        if isinstance(first, enum.Enum):
            return kind(value)
        if _is_named(first) and type(value) is tuple:
            return kind(*value)
        if _is_scalar(first) and type(value) is type(first.item()):
            return kind(value)
    except (TypeError, ValueError):
        pass
    raise _wrong(name, first, value)


_TAGS = {"$tuple", "$array", "$dict"}


def _packed(value: Any) -> Any:
    """Returns a plain value as objects of CBOR; tuples and arrays of numpy are tagged."""
    value = value.item() if _is_scalar(value) else value
    kind = type(value)
    if value is None or kind in (bool, int, float, str, bytes):
        return value
    if kind is list:
        return [_packed(item) for item in value]
    if kind is tuple:
        return {"$tuple": [_packed(item) for item in value]}
    if kind is dict:
        table = {key: _packed(item) for key, item in value.items()}
        return {"$dict": table} if len(table) == 1 and table.keys() <= _TAGS else table
    if (numpy := sys.modules.get("numpy")) is not None and kind is numpy.ndarray:
        if value.dtype.hasobject:
            raise TypeError("an array of objects can't be saved: use one of numbers")
        # The names of a structured type are in its description alone.
        dtype = _packed(numpy.lib.format.dtype_to_descr(value.dtype))
        return {"$array": {"dtype": dtype, "shape": list(value.shape), "data": value.tobytes()}}
    what = "inside of another value" if isinstance(value, enum.Enum) or _is_named(value) else "here"
    raise TypeError(
        f"a {kind.__name__} can't be saved {what}: only None, booleans, numbers, text, bytes, lists, tuples, dicts with "
        "text for keys, and arrays of numpy can; an enumeration or a NamedTuple only as a whole state"
    )


def _unpacked(value: Any) -> Any:
    if isinstance(value, list):
        return [_unpacked(item) for item in value]
    if not isinstance(value, dict):
        return value
    if value.keys() == {"$tuple"}:
        return tuple(_unpacked(item) for item in value["$tuple"])
    if value.keys() == {"$array"}:
        import numpy

        array = value["$array"]
        dtype = numpy.lib.format.descr_to_dtype(_unpacked(array["dtype"]))
        # A copy by numpy would not have the bytes between fields.
        return numpy.ndarray(array["shape"], dtype, bytearray(array["data"]))
    table = value["$dict"] if value.keys() == {"$dict"} else value
    return {key: _unpacked(item) for key, item in table.items()}
