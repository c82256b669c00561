"""Values and keys as TOML on one line, and read from "path=value" texts."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

import tomli_w


def toml_value(value: Any) -> str:
    """A value as TOML on one line: lists in brackets, tables inline; other objects as text."""
    if isinstance(value, Mapping):
        inside = ", ".join(f"{toml_key(k)} = {toml_value(v)}" for k, v in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(toml_value, value))}]"
    plain = value if isinstance(value, (str, int, float, bool)) else str(value)
    return tomli_w.dumps({"k": plain}).removeprefix("k = ").rstrip("\n")


def toml_key(key: str) -> str:
    """A key, in quotes where it needs them."""
    return tomli_w.dumps({key: 0}).removesuffix(" = 0\n")


def value_of(text: str) -> Any:
    """A value as TOML reads it; what TOML does not read is text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return text


def read_overrides(
    overrides: Sequence[str] | Mapping[str, Any],
) -> tuple[list[tuple[str, Any]], list[str]]:
    """Paths and values of "path=value" texts or of a mapping, and what is wrong with them."""
    if isinstance(overrides, Mapping):
        return [(str(path), plain(value)) for path, value in overrides.items()], []
    pairs: list[tuple[str, Any]] = []
    problems = []
    for text in [overrides] if isinstance(overrides, str) else overrides:
        path, sep, value = str(text).partition("=")
        if sep and path.strip():
            pairs.append((path.strip(), value_of(value.strip())))
        else:
            problems.append(
                f"--set {text!r}: write it as path=value, for example contact.friction=0.3"
            )
    return pairs, problems


def plain(data: Any) -> Any:
    """A copy of tables and lists as TOML has them, numpy's numbers and arrays as Python's."""
    if isinstance(data, Mapping):
        return {str(k): plain(v) for k, v in data.items()}
    if isinstance(data, (list, tuple)):
        return [plain(v) for v in data]
    return data.tolist() if hasattr(data, "tolist") else data


def put_back(data: dict[str, Any], steps: Sequence[str | int], value: Any) -> dict[str, Any]:
    """A copy of a scene's data with one value replaced."""
    head, *rest = steps
    out: Any = data.copy()
    out[head] = put_back(out[head], rest, value) if rest else value
    return out  # type: ignore[no-any-return]
