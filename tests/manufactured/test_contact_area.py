"""Contact area of whole scenes whose contact is no sphere on a plane."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import upd
from upd.reference import contact_modulus, hertz_sphere
from upd.report.notebook import RunResult

OWN_DAMPER = Path(upd.__file__).parent / "scenes" / "examples" / "own_damper.toml"
#: nothing is solved beside it
ALONE = {"want": ["normal"], "left_out.solve": "no"}


def own_damper(**changes: Any) -> RunResult:
    settings = {key.replace("__", "."): value for key, value in changes.items()}
    return upd.run(OWN_DAMPER, overrides={**ALONE, **settings})


def test_a_flat_face_in_full_contact_has_its_own_area() -> None:
    result = own_damper(geometry__crown="1e9 m", geometry__divisions=8)
    assert result.value("contact_area") == pytest.approx(16e6, rel=1e-9)
    assert result.value("contact_area_nodes") == pytest.approx(16e6, rel=1e-9)
    assert result.value("contact_area_resolution") == 0.0
    assert result.value("mean_pressure") == pytest.approx(400.0 / 16.0, rel=1e-9)


def test_a_crowned_face_has_hertz_area() -> None:
    """A crown of 300 mm on boxes of 4 mm: near Hertz's circle, three spacings in radius."""
    result = own_damper()
    exact = 1e6 * hertz_sphere(400.0, 300.0, contact_modulus(2e5, 0.3, 2e5, 0.3)).area
    area, resolution = (result.value(n) for n in ("contact_area", "contact_area_resolution"))
    assert abs(area - exact) < resolution
    assert abs(result.value("contact_area_nodes") - exact) > abs(area - exact)
    assert result.value("mean_pressure") == pytest.approx(400.0 / (1e-6 * area), rel=1e-12)


def test_a_wedge_has_area_and_resolution() -> None:
    coarse = {"geometry.divisions": 6, "geometry.divisions_long": 16, "geometry.growth": 1.6}
    result = upd.run("symmetric", overrides={**coarse, **ALONE, "loads.normal": ["100 N"]})
    whole = 15.0 * 42.5
    share, area = 0.01 * result.value("closed_share"), result.value("contact_area")
    assert result.value("contact_area_nodes") == pytest.approx(share * whole, rel=1e-9)
    assert abs(area - share * whole) <= result.value("contact_area_resolution") + 1e-9 * whole
    assert np.isclose(result.value("mean_pressure") * area, 100.0, rtol=1e-12)
