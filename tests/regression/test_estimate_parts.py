"""Numbers of small scenes with every part of their estimated errors, as in estimate_parts.json.

Names, cases, sources and how each error was found are the same to the letter; numbers to 1e-6, as
other machines round otherwise. ``python tests/regression/test_estimate_parts.py`` writes the file
again.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import upd

pytestmark = pytest.mark.estimated

FILE = Path(__file__).with_name("estimate_parts.json")
RECIPE = Path(upd.__file__).parent / "scenes" / "examples" / "own_damper.py"
ALONE = {"left_out.solve": "no"}
SPHERE: dict[str, Any] = {
    **ALONE,
    "want": ["normal", "stiffness", "tangential"],
    "geometry.patch": "0.6 mm",
    "geometry.divisions": 10,
    "loads.normal": ["50 N"],
    "loads.tangential": [0.5],
}
#: name -> scene, overrides
SCENES: dict[str, tuple[Any, dict[str, Any]]] = {
    "neighbouring loads": ("hertz", SPHERE),
    "coupled": ("hertz", SPHERE | {"contact.coupling": "coupled", "geometry.divisions": 8}),
    "own recipe": (
        {
            "name": "mine",
            "want": ["normal", "stiffness"],
            "geometry": {"recipe": str(RECIPE), "crown": "300 mm", "divisions": 8},
            "mesh": {"element": "hex8i"},
            "materials": {body: {"E": "200 GPa", "nu": 0.3} for body in ("damper", "platform")},
            "loads": {"normal": ["400 N"]},
        },
        ALONE,
    ),
    "flat": (
        "symmetric",
        {
            **ALONE,
            "want": ["normal", "stiffness"],
            "geometry.divisions": 8,
            "geometry.divisions_long": 16,
            "geometry.thickness": "10 mm",
            "geometry.margin": "4 mm",
            "loads.normal": ["100 N"],
        },
    ),
    "rig": (
        "rig",
        {
            **ALONE,
            "want": ["free", "reduction"],
            "mesh.element": "hex8i",
            "geometry.refine": 0.8,
            "modes.arrangements": ["symmetric"],
            # one part is 1e-5 and the difference of two frequencies: pardiso's depend on threads
            "solver.name": "superlu",
        },
    ),
    "seated": (
        "symmetric-seated",
        {
            **ALONE,
            "want": ["seating"],
            "geometry.patch_along_y": 12,
            "geometry.patch_along_slope": 4,
            "seating.steps": 4,
        },
    ),
}


def rows(name: str) -> list[list[Any]]:
    """Name, case and value of every number that has parts; source, error and basis of each."""
    scene, overrides = SCENES[name]
    return [
        [one.name, one.case.label, one.value]
        + [
            item
            for part in one.parts
            for item in (part.source, part.error if part.known else None, _told(part.basis))
        ]
        for one in upd.run(scene, overrides=overrides).results
        if one.parts
    ]


def _told(basis: str) -> str:
    """How an error was found, without the numbers that are zero but for rounding."""
    return basis.partition("(")[0] if "other sign" in basis else basis


@pytest.mark.parametrize("name", SCENES)
def test_parts_of_errors_stay(name: str) -> None:
    found, kept = rows(name), json.loads(FILE.read_text(encoding="utf-8"))[name]
    assert [one[:2] for one in found] == [one[:2] for one in kept]
    for one, other in zip(found, kept, strict=True):
        assert [type(item) for item in one] == [type(item) for item in other], one[:2]
        for item, old in zip(one, other, strict=True):
            near = pytest.approx(old, rel=1e-6, abs=1e-12) if isinstance(old, float) else old
            assert item == near, one[:2]


if __name__ == "__main__":
    made = (f'"{name}": [\n' + ",\n".join(map(json.dumps, rows(name))) + "\n]" for name in SCENES)
    FILE.write_text("{\n" + ",\n".join(made) + "\n}\n", encoding="utf-8")
