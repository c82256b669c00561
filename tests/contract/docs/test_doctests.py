"""The examples in the docstrings of the solver packages run and print what they promise."""

from __future__ import annotations

import doctest
import importlib
import pkgutil

import pytest

PACKAGES = ("contact", "hbm", "dynamics", "linalg", "fem", "measured", "reduction", "reference")

#: functions whose docstring must show an example
MAIN = {
    "contact": (
        "ContactLaw",
        "contact_points",
        "normal_contact",
        "tangential_contact",
        "tangential_path",
        "tilted_contact",
    ),
    "hbm": ("contacts", "frequency_response", "rigid_damper", "steady_state"),
    "dynamics": ("find_peaks", "frequency_response", "tune_damping"),
    "measured": ("fit_damping", "frac", "noisy_peaks", "read_measured"),
}
MAIN_FUNCTIONS = [f"upd.{package}:{function}" for package in MAIN for function in MAIN[package]]


def _modules() -> list[str]:
    """Names of the packages and of all modules in them."""
    names = []
    for package in PACKAGES:
        home = importlib.import_module(f"upd.{package}")
        names.append(home.__name__)
        names += [found.name for found in pkgutil.walk_packages(home.__path__, f"{home.__name__}.")]
    return names


@pytest.mark.parametrize("name", _modules())
def test_examples_of_module(name: str) -> None:
    module = importlib.import_module(name)
    results = doctest.testmod(module)
    assert results.failed == 0, f"{results.failed} of {results.attempted} examples in {name} fail"


@pytest.mark.parametrize("name", MAIN_FUNCTIONS)
def test_main_function_has_an_example(name: str) -> None:
    home, attribute = name.split(":")
    documented = getattr(importlib.import_module(home), attribute)
    examples = doctest.DocTestParser().get_examples(documented.__doc__ or "")
    assert any(example.want for example in examples), f"{name} shows no result in its docstring"
