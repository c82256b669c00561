"""No module is hidden by a function of the same name that its package exports."""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType

import pytest


@pytest.mark.parametrize("package", ["upd.linalg", "upd.fem", "upd.reduction", "upd.reference"])
def test_every_module_can_be_reached_as_an_attribute(package: str) -> None:
    parent = importlib.import_module(package)
    names = [module.name for module in pkgutil.iter_modules(parent.__path__)]
    for name in names:
        importlib.import_module(f"{package}.{name}")
    assert len(names) >= 3
    assert [n for n in names if not isinstance(getattr(parent, n), ModuleType)] == []
