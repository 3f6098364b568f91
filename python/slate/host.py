"""Process of a module in Python: an agent starts `python3 -m slate.host` for each of its modules."""

import importlib.util
import linecache
import os
import sys
from pathlib import Path
from types import ModuleType

from ._slate import serve_module
from .module import Module, _seed_random


def load(file: Path, copy: Path) -> list[type[Module]]:
    """Runs a source file; returns its classes of modules, in the order of their declaration."""
    file = Path(file)
    # Files beside it can be imported, as in a program.
    sys.path.insert(0, str(file.parent))
    module = ModuleType(file.stem)
    module.__file__ = str(file)
    sys.modules[file.stem] = module
    source = Path(copy).read_bytes()
    code = compile(source, str(file), "exec")
    # Tracebacks show the source that runs, also after the file was edited.
    lines = importlib.util.decode_source(source).splitlines(keepends=True)
    linecache.cache[str(file)] = (len(source), None, lines, str(file))
    # The seed of the run is not known yet.
    _seed_random("")
    exec(code, module.__dict__)
    # A class may have several names.
    own = dict.fromkeys(
        value
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, Module)
        and "_kind" in vars(value)
        and value.__module__ == module.__name__
    )
    if not own:
        raise ValueError('it has no module: expected a class such as `class Follower(slate.Module, stage="Act")`')
    return list(own)


def main() -> None:
    # The standard output is that of the program that runs the agent: nothing that a module, its libraries and its
    # processes print may get there.
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    # A thread of the module gives the interpreter to the next tick within that time, s; five milliseconds by default.
    sys.setswitchinterval(0.0005)
    serve_module(load)


if __name__ == "__main__":
    main()
