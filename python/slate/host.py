"""Process of a module in Python: an agent starts `python3 -m slate.host` for each of its modules."""

import sys
from pathlib import Path
from types import ModuleType

from ._slate import serve_module
from .module import Module


def load(file: Path, copy: Path) -> list[type[Module]]:
    """Runs a source file; returns its classes of modules, in the order of their declaration."""
    file = Path(file)
    # Files beside it can be imported, as in a program.
    sys.path.insert(0, str(file.parent))
    module = ModuleType(file.stem)
    module.__file__ = str(file)
    sys.modules[file.stem] = module
    source = Path(copy).read_bytes()
    exec(compile(source, str(file), "exec"), module.__dict__)
    own = [
        value
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, Module)
        and "_kind" in vars(value)
        and value.__module__ == module.__name__
    ]
    if not own:
        raise ValueError('it has no module: expected a class such as `class Follower(slate.Module, stage="Act")`')
    return own


def main() -> None:
    # What a module prints is no answer of the program that runs the agent.
    sys.stdout = sys.stderr
    serve_module(load)


if __name__ == "__main__":
    main()
