"""Every test of literature says where its numbers stand: author, year and place."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

LITERATURE = Path(__file__).resolve().parents[2] / "literature"

#: initials and surname, "T. C. Huang"; or a body that publishes without naming anyone
AUTHOR = re.compile(r"(?:\b[A-Z]\. ?)+[A-Z][^\W\d_]+|\bNAFEMS\b")
YEAR = re.compile(r"\b(?:18|19|20)\d\d\b")
#: where in it: an equation, a table, a page, a named test or script
PLACE = re.compile(
    r"\b(?:equations?|sections?|tables?|figures?|chapters?|pages?|test|script) "
    r"\(?[A-Z\d]|\bscript \w|\) \d{2,}\b",
    re.IGNORECASE,
)


def cited(text: str) -> bool:
    return all(pattern.search(text) for pattern in (AUTHOR, YEAR, PLACE))


def literature() -> list[tuple[str, str]]:
    """Each test function with its own docstring and its module's."""
    found = []
    for path in sorted(LITERATURE.rglob("test_*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                # A citation stands in one place: half of it here and half there belongs to two
                # sources.
                found.append(
                    (
                        f"{path.name}::{node.name}",
                        max((ast.get_docstring(n) or "" for n in (node, tree)), key=cited),
                    )
                )
    return found


def test_there_is_literature() -> None:
    assert len(literature()) > 20


@pytest.mark.parametrize(
    ("name", "docstring"), [pytest.param(*found, id=found[0]) for found in literature()]
)
def test_author_year_and_place_are_cited(name: str, docstring: str) -> None:
    assert cited(docstring), (
        f"{name}: cite author (T. C. Huang), year and place (table 3, equation (2.1), page "
        "579) in a docstring"
    )


@pytest.mark.parametrize(
    ("text", "enough"),
    [
        ("T. C. Huang, J. Appl. Mech. 28 (1961) 579", True),
        ("R. D. Blevins, Formulas, 1979, table 8-1", True),
        ("NAFEMS, The Standard NAFEMS Benchmarks, Rev. 3 (1990), test FV52", True),
        ("R. D. Blevins, Formulas, table 8-1", False),
        ("Formulas, 1979, table 8-1", False),
        ("R. D. Blevins, Formulas, 1979", False),
        ("within one per cent on meshes that run in seconds", False),
    ],
)
def test_a_citation_is_told_from_none(text: str, enough: bool) -> None:
    assert cited(text) is enough
