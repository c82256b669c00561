"""Printed values of a scene.

Which publication printed which number of the same bodies under the same load, and where. The theory
behind each is recomputed, not copied.

References
----------
.. [1] "Investigation of the dynamic behaviour of underplatform dampers" (master's thesis,
   Politecnico di Torino). The text at hand names neither author nor year; the experiments it uses
   were made at the LAQ AERMEC laboratory, Politecnico di Torino, in 2005.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

# Of the thesis, in mm, N, MPa, N/mm, Hz.

#: steel of Table I, its "200 MPa" read as 200 GPa: MPa, -, t/mm3
THESIS_STEEL: Mapping[str, float] = {"E": 200_000.0, "nu": 0.3, "rho": 7.8e-9}
#: radius (mm) of the half-sphere: the one that gives the Hertz columns of Tables VII and VIII
THESIS_RADIUS = 5.0
#: Tables VII and VIII, numerical method: load (N) -> field of HertzPoint -> value; the areas are 69
#: and 181 lattice cells
THESIS_HERTZ: Mapping[float, Mapping[str, float]] = {
    50.0: {
        "radius": 0.117,
        "approach": 2.73e-3,
        "area": 4.31e-2,
        "max_pressure": 1800.0,
        "mean_pressure": 1160.0,
    },
    200.0: {
        "radius": 0.189,
        "approach": 6.98e-3,
        "area": 0.1131,
        "max_pressure": 2930.0,
        "mean_pressure": 1767.0,
    },
}
#: Table IX: load (N) -> approach corrected for the bodies beyond depth 3a; 23 % of a half-space's
#: own displacement is beyond it too, so not comparable with Hertz
THESIS_COMPRESSION: Mapping[float, float] = {50.0: 2.60e-3, 200.0: 6.50e-3}
#: Table X: load (N) -> normal stiffness with that approach; its unit "um" read as N/mm. At 200 N it
#: is a copy of Table IX: 1.5 F/d gives 4.62e4
THESIS_STIFFNESS: Mapping[float, float] = {50.0: 3.3e4, 200.0: 6.50e4}
#: Tables XI and XII: damper -> contact stiffness (N/mm), body flexibility included; of the
#: asymmetric damper's two pads that of one (section 8.4)
THESIS_CONTACT_STIFFNESS: Mapping[str, Mapping[str, float]] = {
    "symmetric": {"K_N": 1.56e6, "K_T": 4.90e5},
    "asymmetric": {"K_N": 4.71e5, "K_T": 1.50e5},
}
#: Tables II to VI: natural frequencies (Hz); the caption of Table V has "forced" for the glued
#: condition
THESIS_FREQUENCIES: Mapping[str, tuple[float, ...]] = {
    "experiment_free": (295.0,),
    "experiment_symmetric": (340.0,),
    "experiment_asymmetric": (377.0, 440.0),
    "free_symmetric": (294.88, 295.19, 783.88, 784.94),
    "free_asymmetric": (294.77, 294.78, 784.06, 784.29),
    "glued_symmetric": (446.60, 463.92, 783.97, 1030.10),
    "craig_bampton_symmetric": (294.89, 295.20, 784.08, 784.98),
}


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


#: a printed value, in the unit of the number it is compared with, and its source
Printed = tuple[float, str]
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
    sphere = {"radius": THESIS_RADIUS, "block": 10.0}
    for load, table in ((50.0, "VII"), (200.0, "VIII")):
        row = THESIS_HERTZ[load]
        tables = {
            table: {name: row[key] * unit for name, (key, unit) in _HERTZ.items()},
            "IX": {"approach_within_3a": THESIS_COMPRESSION[load] * 1e3},
            "X": {"K_N_tangent_3a": THESIS_STIFFNESS[load]},
        }
        for name, values in tables.items():
            source = f"thesis, Table {name}"
            yield PrintedTable(source, "sphere_block", values, sphere, _STEEL, {"load": load})
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


def printed_values(recipe: str, geometry: Mapping[str, Any], materials: Iterable[Any]) -> Lookup:
    """Look up what was printed of these bodies.

    Parameters
    ----------
    recipe, geometry
        Name of the geometry and its parameters, mm.
    materials
        Of every body, with ``E`` in MPa and ``nu``.

    Returns
    -------
    Lookup
        ``(name, fields of the case) -> printed values``: none, one, or several peaks whose order is
        not that of a run.

    Examples
    --------
    >>> printed_values("wedge_platform", {}, [])("K_N_secant_raw", {"load": 154.7})
    ((1560000.0, 'thesis, Table XI'),)
    """
    bodies = list(materials)
    mine = [
        table
        for table in PRINTED
        if table.recipe == recipe
        and table.geometry.items() <= geometry.items()
        and all(getattr(body, k) == v for body in bodies for k, v in table.material.items())
    ]

    def lookup(name: str, case: Mapping[str, Any]) -> tuple[Printed, ...]:
        for table in mine:
            if all(case.get(key, "") == value for key, value in table.case.items()):
                for pattern, values in table.values.items():
                    if fnmatchcase(name, pattern):
                        several = values if isinstance(values, tuple) else (values,)
                        return tuple((v, table.source) for v in several)
        return ()

    return lookup
