"""Numbers printed in the source thesis, to be compared with; in mm, N, MPa, N/mm, Hz.

The theory behind each is recomputed, not copied.

References
----------
.. [1] "Investigation of the dynamic behaviour of underplatform dampers" (master's thesis,
   Politecnico di Torino). The text at hand names neither author nor year; the experiments it uses
   were made at the LAQ AERMEC laboratory, Politecnico di Torino, in 2005.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from upd.reference.hertz import HertzPoint, contact_modulus, hertz_sphere

THESIS = (
    "Investigation of the dynamic behaviour of underplatform dampers (master's thesis, "
    "Politecnico di Torino)"
)

#: steel of Table I, its "200 MPa" read as 200 GPa: MPa, -, t/mm3
THESIS_STEEL: Mapping[str, float] = MappingProxyType({"E": 200_000.0, "nu": 0.3, "rho": 7.8e-9})
#: radius (mm) of the half-sphere: the one that gives the Hertz columns of Tables VII and VIII
THESIS_RADIUS = 5.0


@dataclass(frozen=True)
class ThesisValue:
    """One row of a table: the thesis's result, the theory printed beside it, and that recomputed.

    Attributes
    ----------
    table, name : str
        Number of the table, and the quantity.
    load : float
        N.
    unit : str
        Of value, theory and exact.
    value : float
        The thesis's own result.
    theory : float
        Printed beside it.
    difference : float
        The printed one, a ratio (0.058 for +5.8 %).
    exact : float
        The same theory recomputed.
    remark : str
    """

    table: str
    name: str
    load: float
    unit: str
    value: float
    theory: float
    difference: float
    exact: float
    remark: str = ""

    @property
    def error(self) -> float:
        """Relative error of the thesis's result against the exact closed form."""
        return self.value / self.exact - 1


def exact_hertz(load: float) -> HertzPoint[float]:
    """The exact Hertz contact of the thesis's sphere on its block at the load (N)."""
    E, nu = THESIS_STEEL["E"], THESIS_STEEL["nu"]
    return hertz_sphere(load, THESIS_RADIUS, contact_modulus(E, nu, E, nu))


_UNITS = {
    "radius": "mm",
    "approach": "mm",
    "area": "mm2",
    "max_pressure": "MPa",
    "mean_pressure": "MPa",
    "tangent_stiffness": "N/mm",
}
# (numerical method, Hertz formulae, difference) as printed, lengths turned into mm
_PRINTED = {
    ("VII", 50.0): {
        "radius": (0.117, 0.119, -0.016),
        "approach": (2.73e-3, 2.85e-3, -0.042),
        "area": (4.31e-2, 4.48e-2, -0.037),
        "max_pressure": (1800.0, 1700.0, 0.058),
        "mean_pressure": (1160.0, 1150.0, 0.008),
    },
    ("VIII", 200.0): {
        "radius": (0.189, 0.189, 0.0),
        "approach": (6.98e-3, 7.16e-3, -0.025),
        "area": (0.1131, 0.1130, 0.0009),
        "max_pressure": (2930.0, 2650.0, 0.090),
        "mean_pressure": (1767.0, 1769.0, -0.0011),
    },
}
_REMARKS = {
    ("VII", "max_pressure"): "Hertz gives 1672 MPa, not 1700",
    ("VII", "mean_pressure"): "Hertz gives 1115 MPa, not 1150",
    ("VII", "area"): "69 lattice cells",
    ("VIII", "area"): "181 lattice cells",
    ("VIII", "radius"): "189.8 um by the printed area",
    ("VIII", "max_pressure"): "the printed values differ by +10.6 %, not +9.0 %",
}


def _row(
    table: str, name: str, load: float, printed: tuple[float, float, float], remark: str = ""
) -> ThesisValue:
    """A row with its result, theory and difference as printed."""
    exact = getattr(exact_hertz(load), name)
    return ThesisValue(table, name, load, _UNITS[name], *printed, exact, remark)


#: Tables VII and VIII: load (N) -> name -> row, with the printed theory, the printed difference and
#: the error against the exact value
THESIS_HERTZ_ROWS: Mapping[float, Mapping[str, ThesisValue]] = MappingProxyType(
    {
        load: MappingProxyType(
            {
                name: _row(table, name, load, printed, _REMARKS.get((table, name), ""))
                for name, printed in entries.items()
            }
        )
        for (table, load), entries in _PRINTED.items()
    }
)
#: Tables VII and VIII, numerical method only: load (N) -> name -> value; the names are the fields
#: of HertzPoint
THESIS_HERTZ: Mapping[float, Mapping[str, float]] = MappingProxyType(
    {
        load: MappingProxyType({name: row.value for name, row in rows.items()})
        for load, rows in THESIS_HERTZ_ROWS.items()
    }
)


_CORRECTED = (
    "corrected for the bodies beyond depth 3a; 23 % of a half-space's own displacement is "
    "beyond it too, so not comparable with Hertz"
)
#: Table IX: load (N) -> approach with the bulk compliance removed (value) and before (theory)
THESIS_COMPRESSION: Mapping[float, ThesisValue] = MappingProxyType(
    {
        50.0: _row("IX", "approach", 50.0, (2.60e-3, 2.80e-3, -0.0714), _CORRECTED),
        200.0: _row("IX", "approach", 200.0, (6.50e-3, 7.09e-3, -0.0832), _CORRECTED),
    }
)
#: Table X: load (N) -> normal stiffness with the corrected approach (value) and without (theory),
#: as printed; its unit "um" read as N/mm
THESIS_STIFFNESS: Mapping[float, ThesisValue] = MappingProxyType(
    {
        50.0: _row(
            "X",
            "tangent_stiffness",
            50.0,
            (3.3e4, 2.8e4, 0.15),
            "3.3/2.8 is +17.9 %; 1.5 F/d of Table IX gives 2.68e4 and 2.88e4",
        ),
        200.0: _row(
            "X",
            "tangent_stiffness",
            200.0,
            (6.50e4, 7.09e4, 0.0832),
            "a copy of Table IX; 1.5 F/d of Table IX gives 4.23e4 and 4.62e4",
        ),
    }
)

#: Tables XI and XII: damper -> contact stiffness (N/mm), body flexibility included; of the
#: asymmetric damper's two pads that of one (section 8.4)
THESIS_CONTACT_STIFFNESS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "symmetric": MappingProxyType({"K_N": 1.56e6, "K_T": 4.90e5}),
        "asymmetric": MappingProxyType({"K_N": 4.71e5, "K_T": 1.50e5}),
    }
)

#: Tables II to VI: natural frequencies (Hz); the caption of Table V has "forced" for the glued
#: condition
THESIS_FREQUENCIES: Mapping[str, tuple[float, ...]] = MappingProxyType(
    {
        "experiment_free": (295.0,),
        "experiment_symmetric": (340.0,),
        "experiment_asymmetric": (377.0, 440.0),
        "free_symmetric": (294.88, 295.19, 783.88, 784.94),
        "free_asymmetric": (294.77, 294.78, 784.06, 784.29),
        "glued_symmetric": (446.60, 463.92, 783.97, 1030.10),
        "craig_bampton_symmetric": (294.89, 295.20, 784.08, 784.98),
    }
)
