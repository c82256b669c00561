"""Linear elastic, isotropic material."""

from __future__ import annotations

import math
from dataclasses import dataclass

from upd.errors import InputError

#: density of steel, t/mm3
STEEL_DENSITY = 7.8e-9


@dataclass(frozen=True)
class Material:
    """Isotropic linear elasticity.

    Parameters
    ----------
    E : float
        Young's modulus, MPa.
    nu : float
        Poisson ratio, between -1 and 0.5, both excluded.
    rho : float, default 7.8e-9
        Density, t/mm3; steel by default.

    Raises
    ------
    InputError
        That lists every value out of range.
    """

    E: float
    nu: float
    rho: float = STEEL_DENSITY

    def __post_init__(self) -> None:
        checks = (
            (
                self.E > 0.0 and math.isfinite(self.E),
                f"E = {self.E!r} MPa: give a positive Young's modulus, e.g. 200e3 for steel",
            ),
            (
                -1.0 < self.nu < 0.5,
                f"nu = {self.nu!r}: give a Poisson ratio between -1 and 0.5, both excluded "
                "(0.499 for a nearly incompressible solid)",
            ),
            (
                self.rho > 0.0 and math.isfinite(self.rho),
                f"rho = {self.rho!r} t/mm3: give a positive density, e.g. 7.8e-9 for steel",
            ),
        )
        problems = [message for ok, message in checks if not ok]
        if problems:
            raise InputError("Material: " + "; ".join(problems) + ".")

    @property
    def G(self) -> float:
        """Shear modulus E / (2 (1 + nu)), MPa."""
        return self.E / (2.0 * (1.0 + self.nu))

    @property
    def mu(self) -> float:
        """Second Lamé parameter, MPa: the shear modulus."""
        return self.G

    @property
    def lam(self) -> float:
        """First Lamé parameter E nu / ((1 + nu) (1 - 2 nu)), MPa."""
        return self.E * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu))
