"""Values and keys as TOML, each on one line."""

from __future__ import annotations

from collections.abc import Mapping
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
