"""Attributes of groups in result.nc files of modal and forced runs written before groups carried
any: from their names, only here.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from upd.plot.chart import Group

Found = re.Match[str]
_RATIO = r"F_C per F_E (?P<ratio>\d+(?:\.\d+)?(?:e[+-]?\d+)?)"
_KIND = re.compile(r".+, (?P<kind>free|stuck)")
#: name of a group -> what it held
_NAMES: tuple[tuple[re.Pattern[str], Callable[[Found], dict[str, Any]]], ...] = (
    (
        re.compile(r"modes (?P<kind>\w+) (?P<arrangement>\w+)"),
        lambda m: {"content": "modes"} | m.groupdict(),
    ),
    (
        re.compile(r"response (?P<kind>free|glued)"),
        lambda m: {"content": "response"} | m.groupdict(),
    ),
    (re.compile(r"(?P<content>points|linear) (?P<stiffness>.+)"), lambda m: m.groupdict()),
    (
        re.compile(rf"friction (?P<stiffness>.+), {_RATIO}(?P<down>, downwards)?"),
        lambda m: _friction(m),
    ),
    (
        re.compile(r"performance (?P<stiffness>.+), (?P<branch>peak(?: \d+)?)"),
        lambda m: {"content": "performance"} | m.groupdict(),
    ),
)
#: a variable that every group of the content has: other files may use the same names
_HAS = {
    "modes": "frequency",
    "response": "frequency",
    "points": "k_n",
    "linear": "stuck_mode",
    "friction": "energy_balance",
    "performance": "ratio",
}


def attributes_of(name: str, group: Group) -> dict[str, Any]:
    """Attributes a group of an older result.nc would have today.

    Parameters
    ----------
    name
        Of the group.
    group
        Its variables.

    Returns
    -------
    dict
        ``content`` and the fields of the case; empty for a group of another kind.

    Examples
    --------
    >>> from upd.plot.chart import Group
    >>> attributes_of("modes free symmetric", Group() | {"frequency": ...})
    {'content': 'modes', 'kind': 'free', 'arrangement': 'symmetric'}
    """
    for pattern, attributes in _NAMES:
        if found := pattern.fullmatch(name):
            mine = attributes(found)
            return mine if _HAS[mine["content"]] in group else {}
    return {}


def fields_of(case: str) -> dict[str, Any]:
    """Fields of the case of a number in an older summary.json that choose the main numbers.

    Linear curves have a kind.
    """
    found = _KIND.fullmatch(case)
    return found.groupdict() if found else {}


def _friction(found: Found) -> dict[str, Any]:
    mine = {
        "content": "friction",
        "stiffness": found["stiffness"],
        "force_ratio": float(found["ratio"]),
    }
    return mine | ({"reversed": True} if found["down"] else {})
