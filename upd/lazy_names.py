"""Names of a package that are loaded when they are used."""

from __future__ import annotations

from importlib import import_module


def load_on_use(package: str, homes: dict[str, str]) -> tuple[object, object, list[str]]:
    """``__getattr__``, ``__dir__`` and ``__all__`` of a package that loads its names when they are
    used: what needs few of its modules loads few.

    ``homes``: module -> its public names; under "" the modules that are public themselves.
    """
    places = {name: module for module, names in homes.items() for name in names.split()}

    def found(name: str) -> object:
        if name not in places:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if not places[name]:
            return import_module(f"{package}.{name}")
        return getattr(import_module(f"{package}.{places[name]}"), name)

    return found, lambda: sorted(places), sorted(places)
