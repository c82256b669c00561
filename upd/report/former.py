"""Run folders from before cases were data.

What the names of their groups and the labels of their numbers said.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from upd.plot.chart import Entry, Group
from upd.report import former_contact, former_dynamic

_READERS = (former_contact.attributes_of, former_dynamic.attributes_of)


def add_attributes(arrays: Mapping[str, Group]) -> None:
    """Give every group that does not say what it holds the attributes its name stands for."""
    for name, group in arrays.items():
        if "content" not in group.attributes:
            for reader in _READERS:
                group.attributes.update(reader(name, group))


def with_fields(results: Iterable[Entry]) -> list[Entry]:
    """Numbers of a summary.json.

    One without the fields of its case gets those that choose the main numbers.
    """
    return [
        {"case_fields": former_dynamic.fields_of(str(entry["case"])), **entry} for entry in results
    ]
