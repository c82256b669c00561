"""Sizes of pictures, and runs without them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest


def png_size(png: bytes) -> tuple[int, int]:
    """Width and height in pixels, from the header every PNG begins with."""
    return int.from_bytes(png[16:20], "big"), int.from_bytes(png[20:24], "big")


@contextmanager
def no_figures() -> Iterator[None]:
    """Run folders without figures, which take longer than small scenes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("upd.runner.write_figures", lambda *_: [])
        yield
