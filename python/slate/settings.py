"""Settings as texts of TOML."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from .property import _plain


def setting(value: Any) -> str:
    """Text of a setting's value; a str is text of TOML as it is."""
    return value if isinstance(value, str) else _literal(_plain(value))


def _literal(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return int.__repr__(value)
    if isinstance(value, float):
        # `inf` and `nan` are spelled alike in both languages.
        return float.__repr__(value)
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_literal, value))}]"
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{_quoted(str(key))} = {_literal(_plain(item))}' for key, item in value.items())} }}"
    raise TypeError(f"a setting is a number, a text, a bool, a list or a dict of those, found {value!r}")


def _quoted(text: str) -> str:
    # TOML escapes as JSON does, and one character more.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
