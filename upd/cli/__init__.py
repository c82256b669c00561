"""The command line: thin. Every command is a call a Python user can make."""

from __future__ import annotations

from upd.cli.app import main

__all__ = ["main"]
