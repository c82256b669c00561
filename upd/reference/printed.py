"""Printed values of a scene.

Which publication printed which number of the same bodies under the same load, and where.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any, Protocol

from upd.reference.thesis import (
    THESIS_COMPRESSION,
    THESIS_CONTACT_STIFFNESS,
    THESIS_FREQUENCIES,
    THESIS_HERTZ,
    THESIS_HERTZ_ROWS,
    THESIS_RADIUS,
    THESIS_STEEL,
    THESIS_STIFFNESS,
)


@dataclass(frozen=True)
class PrintedTable:
    """Values one table prints, and of what.

    Attributes
    ----------
    source
        Publication and table.
    recipe
        Geometry the values are of.
    values
        Name of a number (shell pattern) -> value in the number's unit, or several of them: peaks
        whose order is not that of a run.
    geometry
        Parameters the geometry must have, mm; the recipe alone decides when empty.
    material
        Constants every body must have.
    case
        Fields of the case, by name; a field that is "" here must be absent there.
    """

    source: str
    recipe: str
    values: Mapping[str, float | tuple[float, ...]]
    geometry: Mapping[str, Any] = field(default_factory=dict)
    material: Mapping[str, float] = field(default_factory=dict)
    case: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Printed:
    """A printed value, in the unit of the number it is compared with."""

    value: float
    source: str


class Elastic(Protocol):
    """A material: E in MPa, and nu."""

    @property
    def E(self) -> float:
        """Young's modulus, MPa."""

    @property
    def nu(self) -> float:
        """Poisson's ratio."""


#: name of a number, fields of its case -> what was printed of it
Lookup = Callable[[str, Mapping[str, Any]], tuple[Printed, ...]]

_STEEL = {"E": THESIS_STEEL["E"], "nu": THESIS_STEEL["nu"]}
#: number of a contact -> field of a Hertz contact, and its unit in mm
_HERTZ = {
    "radius_*": ("radius", 1e3),
    "approach": ("approach", 1e3),
    "contact_area*": ("area", 1e6),
    "max_pressure": ("max_pressure", 1.0),
    "mean_pressure": ("mean_pressure", 1.0),
}
_DAMPERS = {"symmetric": ("wedge_platform", "XI"), "asymmetric": ("pads_platform", "XII")}
_MODES = {("symmetric", "free"): "IV", ("asymmetric", "free"): "IV", ("symmetric", "glued"): "V"}
_PEAKS = {"symmetric": "II", "asymmetric": "III"}


def _thesis_tables() -> Iterable[PrintedTable]:
    for load, row in THESIS_HERTZ.items():
        values = {name: row[key] * unit for name, (key, unit) in _HERTZ.items()}
        source = f"thesis, Table {THESIS_HERTZ_ROWS[load]['radius'].table}"
        sphere = {"radius": THESIS_RADIUS, "block": 10.0}
        yield PrintedTable(source, "sphere_block", values, sphere, _STEEL, {"load": load})
        corrected = {
            "IX": {"approach_within_3a": THESIS_COMPRESSION[load].value * 1e3},
            "X": {"K_N_tangent_3a": THESIS_STIFFNESS[load].value},
        }
        for table, numbers in corrected.items():
            source = f"thesis, Table {table}"
            yield PrintedTable(source, "sphere_block", numbers, sphere, _STEEL, {"load": load})
    for damper, (recipe, table) in _DAMPERS.items():
        K = THESIS_CONTACT_STIFFNESS[damper]
        # From section 8.4 on the thesis looks at one of the two pads alone.
        values = (
            {"K_N_per_pad": K["K_N"], "K_T*_per_pad": K["K_T"]}
            if damper == "asymmetric"
            else {
                "K_N_secant_raw": K["K_N"],
                "K_N_tangent_raw": K["K_N"],
                "K_T*_initial_raw": K["K_T"],
            }
        )
        yield PrintedTable(f"thesis, Table {table}", recipe, values)
    # "a higher pressure in two spots in the lower part of the contact area"
    yield PrintedTable("thesis, section 7.4", "wedge_platform", {"pressure_peaks": 2.0})
    for (arrangement, kind), table in _MODES.items():
        values = {
            f"f{k}_{kind}": f for k, f in enumerate(THESIS_FREQUENCIES[f"{kind}_{arrangement}"], 1)
        }
        case = {"arrangement": arrangement, "kind": kind}
        yield PrintedTable(f"thesis, Table {table}", "blade_rig", values, case=case)
    # Measured peaks: without a damper, then with it. Of the symmetric arrangement one is printed,
    # as the second; which mode it is stands nowhere.
    free = {"peak_frequency": THESIS_FREQUENCIES["experiment_free"]}
    yield PrintedTable("thesis, Table II", "blade_rig", free, case={"kind": "free"})
    for arrangement, table in _PEAKS.items():
        peaks = {"peak_frequency": THESIS_FREQUENCIES[f"experiment_{arrangement}"]}
        yield PrintedTable(
            f"thesis, Table {table}" + ", its second" * (arrangement == "symmetric"),
            "blade_rig",
            peaks,
            {"arrangement": arrangement},
            case={"kind": ""},
        )


PRINTED: tuple[PrintedTable, ...] = tuple(_thesis_tables())


def printed_values(
    recipe: str, geometry: Mapping[str, Any], materials: Iterable[Elastic]
) -> Lookup:
    """Look up what was printed of these bodies.

    Parameters
    ----------
    recipe, geometry
        Name of the geometry and its parameters, mm.
    materials
        Of every body.

    Returns
    -------
    Lookup
        ``(name, fields of the case) -> printed values``: none, one, or several peaks whose order is
        not that of a run.

    Examples
    --------
    >>> printed_values("wedge_platform", {}, [])("K_N_secant_raw", {"load": 154.7})
    (Printed(value=1560000.0, source='thesis, Table XI'),)
    """
    bodies = list(materials)
    mine = [t for t in PRINTED if t.recipe == recipe and _is_of(t, geometry, bodies)]

    def lookup(name: str, case: Mapping[str, Any]) -> tuple[Printed, ...]:
        for table in mine:
            if all(case.get(key, "") == value for key, value in table.case.items()):
                for pattern, values in table.values.items():
                    if fnmatchcase(name, pattern):
                        return tuple(
                            Printed(v, table.source)
                            for v in (values if isinstance(values, tuple) else (values,))
                        )
        return ()

    return lookup


def _is_of(table: PrintedTable, geometry: Mapping[str, Any], bodies: Iterable[Elastic]) -> bool:
    same_shape = all(geometry.get(key) == value for key, value in table.geometry.items())
    return same_shape and all(
        getattr(body, key) == value for body in bodies for key, value in table.material.items()
    )
