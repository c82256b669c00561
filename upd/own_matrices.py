"""The name under which scripts know `upd.matrices.response`."""

from __future__ import annotations

from upd.matrices.response import Joint, OwnResponse, forced_response

__all__ = ["Joint", "OwnResponse", "forced_response"]
