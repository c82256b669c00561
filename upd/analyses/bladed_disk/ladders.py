"""What a convergence study of a bladed disk varies: nothing yet."""

from __future__ import annotations

from collections.abc import Mapping

from upd.vary.ladder import Ladder

LADDERS: Mapping[str, Ladder] = {}
