"""Run folders from before groups had attributes: what the names of their groups said."""

from __future__ import annotations

from collections.abc import Mapping

from upd.plot.chart import Group
from upd.report import former_contact

_READERS = (former_contact.attributes_of,)


def add_attributes(arrays: Mapping[str, Group]) -> None:
    """Give every group that does not say what it holds the attributes its name stands for."""
    for name, group in arrays.items():
        if "content" not in group.attributes:
            for reader in _READERS:
                group.attributes.update(reader(name, group))
