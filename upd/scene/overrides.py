"""What stands beside a scene: "path=value" texts and mappings that change keys of it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from typing import Any


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
        if not sep or not path.strip():
            problems.append(
                f"--set {text!r}: write it as path=value, for example contact.friction=0.3"
            )
            continue
        pairs.append((path.strip(), toml_value(value.strip())))
    return pairs, problems


def toml_value(text: str) -> Any:
    """A value as TOML reads it; what TOML does not read is text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def plain(data: Any) -> Any:
    """A copy of tables and lists as TOML has them, numpy's numbers as Python's."""
    if isinstance(data, Mapping):
        return {str(k): plain(v) for k, v in data.items()}
    if isinstance(data, (list, tuple)):
        return [plain(v) for v in data]
    # numpy's numbers and arrays become Python's.
    return data.tolist() if hasattr(data, "tolist") else data
