"""Sizes of pictures."""

from __future__ import annotations


def png_size(png: bytes) -> tuple[int, int]:
    """Width and height in pixels, from the header every PNG begins with."""
    return int.from_bytes(png[16:20], "big"), int.from_bytes(png[20:24], "big")
