"""Plain data into YAML or JSON text: keys in order, a list of scalars on one line.

The text depends on nothing but the data. It is written so that readers of YAML 1.1 understand it as
those of YAML 1.2 do: `1.0e-05` and not `1e-05`, quotes around `no`.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping
from decimal import Decimal
from typing import Any, Literal

import numpy as np

Form = Literal["yaml", "json"]

_PLAIN = re.compile(r"[A-Za-z_/][A-Za-z0-9_./+-]*(?: [A-Za-z0-9_./+-]+)*")
_RESERVED = frozenset(("y", "n", "yes", "no", "on", "off", "true", "false", "null"))
_UNPRINTABLE = re.compile("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff]")


def dump(data: Mapping[str, Any], form: Form) -> str:
    """Return a document's plain data as text that ends with a line break.

    Args:
        data: Mappings, sequences, text, numbers, booleans, None, numpy scalars and arrays.
        form: `yaml` or `json`.

    Raises:
        ValueError: A number is not finite; JSON has no way to write it.
        TypeError: A value is of another type.
    """
    lines = _yaml_lines(_plain(data)) if form == "yaml" else _json_lines(_plain(data))
    return "\n".join(lines) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def _is_flat(value: Any) -> bool:
    """Whether a value fits on the line of its key: a scalar, a list of them, or nothing."""
    if isinstance(value, list):
        return not any(isinstance(item, list | dict) for item in value)
    return not value if isinstance(value, dict) else True


def _flat(value: Any, quote: Callable[[str], str]) -> str:
    if isinstance(value, list):
        return f"[{', '.join([_flat(item, quote) for item in value])}]"
    if isinstance(value, dict):
        return "{}"
    if isinstance(value, float | Decimal):
        return _number(value)
    if isinstance(value, str):
        return quote(value)
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, int):
        return str(value)
    raise TypeError(f"a document cannot hold a {type(value).__name__}: {value!r}")


def _number(value: float | Decimal) -> str:
    if not math.isfinite(value):
        raise ValueError(f"a document cannot hold the number {value}")
    text = repr(float(value))
    if isinstance(value, Decimal) and Decimal(text) != value:
        text = format(value, "f" if -5 <= value.adjusted() < 17 else "e")
    mantissa, exponent, power = text.partition("e")
    return text if "." in mantissa or not exponent else f"{mantissa}.0e{power}"


def _json_text(text: str) -> str:
    encodable = text.encode("utf-8", "replace").decode("utf-8")
    quoted = json.dumps(encodable, ensure_ascii=False)
    return _UNPRINTABLE.sub(lambda match: f"\\u{ord(match[0]):04x}", quoted)


def _yaml_text(text: str) -> str:
    plain = _PLAIN.fullmatch(text) and text.lower() not in _RESERVED
    return text if plain else _json_text(text)


def _yaml_lines(value: dict[str, Any] | list[Any]) -> Iterator[str]:
    if _is_flat(value):
        yield _flat(value, _yaml_text)
    elif isinstance(value, dict):
        for key, item in value.items():
            if _is_flat(item):
                yield f"{_yaml_text(key)}: {_flat(item, _yaml_text)}"
            else:
                yield f"{_yaml_text(key)}:"
                yield from (f"  {line}" for line in _yaml_lines(item))
    else:
        for item in value:
            bullet = "- "
            for line in _yaml_lines(item):
                yield bullet + line
                bullet = "  "


def _json_lines(value: Any) -> Iterator[str]:
    if _is_flat(value):
        yield _flat(value, _json_text)
        return
    is_list = isinstance(value, list)
    items = [("", item) for item in value] if is_list else [*value.items()]
    yield "[" if is_list else "{"
    for number, (key, item) in enumerate(items, start=1):
        lines = list(_json_lines(item))
        if not is_list:
            lines[0] = f"{_json_text(key)}: {lines[0]}"
        if number < len(items):
            lines[-1] += ","
        yield from (f"  {line}" for line in lines)
    yield "]" if is_list else "}"
