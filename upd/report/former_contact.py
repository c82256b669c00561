"""Names that older run folders gave the groups of a contact, as the attributes groups have now."""

from __future__ import annotations

import re
from typing import Any

from upd.plot.chart import Group

_LOAD = r"F=(?P<load>[-+.\deE]+) N"
_SHEAR = r" T(?:_(?P<direction>\w+))?(?: per muN=(?P<ratio>[-+.\deE]+))?"
# Name of a group -> what it holds.
_NAMES = (
    (re.compile("force-approach"), "force-approach"),
    (re.compile(f"contact law in the rig {_LOAD}"), "contact law in the rig"),
    (re.compile(f"contact law {_LOAD}"), "contact law"),
    (re.compile(f"cycle {_LOAD}{_SHEAR}"), "cycle"),
    (re.compile(f"path {_LOAD}{_SHEAR}"), "path"),
    (re.compile(rf"{_LOAD}{_SHEAR}(?: (?P<patch>.+))?"), "tangential"),
    (re.compile(rf"{_LOAD}(?: (?P<patch>.+))?"), "normal"),
)
_NUMBERS = ("load", "ratio")
# A variable that every group of the content has: other files may use the same names.
_HAS = {
    "force-approach": "approach",
    "contact law in the rig": "law_k_n",
    "contact law": "law_k_n",
    "cycle": "tangential_force",
    "path": "tangential_force",
    "tangential": "stick",
    "normal": "pressure",
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
        ``content``, the fields of the case and the face; empty for a group of another kind.
    """
    for pattern, content in _NAMES:
        found = pattern.fullmatch(name)
        if found and _HAS[content] in group:
            given = {key: value for key, value in found.groupdict().items() if value is not None}
            return {"content": content} | {
                key: float(v) if key in _NUMBERS else v for key, v in given.items()
            }
    return {}
