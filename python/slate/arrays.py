"""Values as arrays of numpy."""

from __future__ import annotations

from typing import Any


def import_numpy() -> Any:
    """The module numpy."""
    try:
        import numpy
    except ImportError as error:
        raise ImportError("arrays need numpy: pip install 'slate-robotics[numpy]'") from error
    return numpy


def image_array(numpy: Any, data: Any, *, width: int, height: int, step: int) -> Any:
    """Pixels of an image: rows, columns, and in color red, green and blue."""
    if height == 0 or width == 0 or len(data) < height * step:
        return numpy.empty((0, 0), dtype=numpy.uint8)
    rows = data[: height * step].reshape(height, step)
    channels = max(1, step // width)
    pixels = rows[:, : width * channels]
    return pixels if channels == 1 else pixels.reshape(height, width, channels)


def grid_array(data: Any, width: int, height: int) -> Any:
    """Cells of a map in percent, -1 if unknown; rows from the lowest y."""
    return data.reshape(height, width)


def record_array(numpy: Any, url: str, value: Any, dtype: Any = None) -> Any:
    """Array of a list: of numbers, or of dicts with a column for each field; None becomes NaN."""
    if not isinstance(value, list):
        kind = "nothing" if value is None else type(value).__name__
        raise TypeError(f"{url}: expected a list, found {kind}: name one of its fields")
    if value and all(isinstance(item, dict) for item in value):
        columns = [_column(numpy, url, [item[name] for item in value], None) for name in value[0]]
        return numpy.rec.fromarrays(columns, names=list(value[0]))
    return _column(numpy, url, value, dtype)


def _column(numpy: Any, url: str, items: list[Any], dtype: Any) -> Any:
    array = numpy.array(items, dtype=float if dtype is None and None in items else dtype)
    if array.dtype == object:
        raise TypeError(f"{url}: expected a list of numbers, found a list of {type(items[0]).__name__}")
    return array
