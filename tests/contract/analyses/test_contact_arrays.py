"""Arrays of a contact run.

Their groups say what they hold and of which case, closed forms lie beside what was computed.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from tests.pictures import no_figures
from upd import run
from upd.plot.common import case_of, scalar, with_content
from upd.reference import (
    contact_modulus,
    hertz_sphere,
    mindlin,
    tangential_compliance_modulus,
)
from upd.report.folder import RunFolder, read_run
from upd.report.notebook import RunResult
from upd.results import Case, read_netcdf

MU, RADIUS, E, NU, F = 0.6, 5.0, 2e5, 0.3, 200.0
HERTZ = ["geometry.divisions=14", 'loads.normal=["50 N", "200 N"]', "loads.tangential=[0.5]"]
DAMPER = [
    "geometry.divisions=4",
    "geometry.divisions_long=10",
    "law.rows=2",
    "law.columns=2",
    "loads.tangential=[0.5]",
]
PADS = [
    "geometry.divisions=4",
    "geometry.divisions_long=6",
    'want=["normal", "tangential"]',
    "loads.tangential=[0.5]",
]


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, RunResult]:
    path = tmp_path_factory.mktemp("runs")
    scenes = {
        "hertz": HERTZ,
        "symmetric": [
            *DAMPER,
            'want=["normal", "stiffness", "curve", "tangential", "cycle", "contact_law"]',
        ],
    }
    scenes["asymmetric"] = PADS
    with no_figures():
        return {
            scene: run(scene, overrides=given, out=path / scene, report=False)
            for scene, given in scenes.items()
        }


@pytest.fixture(scope="module")
def hertz(folders: dict[str, RunResult]) -> RunFolder:
    return _folder(folders["hertz"])


def _folder(result: RunResult) -> RunFolder:
    assert result.folder is not None
    return read_run(result.folder)


@pytest.mark.parametrize("scene", ["hertz", "symmetric", "asymmetric"])
def test_groups_carry_their_case_and_keep_it_in_the_file(
    folders: dict[str, RunResult], scene: str
) -> None:
    result = folders[scene]
    assert result.folder is not None
    kept = read_netcdf(result.folder / "result.nc")
    known = {f.name for f in fields(Case)} | {"content", "patch"}
    for name, group in result.arrays.items():
        attributes = dict(group.attributes)
        read = kept[name.replace("/", " per ")].attributes
        assert read == attributes
        assert set(read) <= known
        case, content = case_of(kept[name.replace("/", " per ")]), read["content"]
        # A group is called by what it holds, its case and its face.
        before = "" if content in ("normal", "tangential") else content
        assert name == " ".join(
            part for part in (before, case.label, read.get("patch", "")) if part
        )
    assert len({tuple(g.attributes.items()) for g in kept.values()}) == len(kept)


def test_cases_are_those_of_the_scene(folders: dict[str, RunResult]) -> None:
    groups = _folder(folders["hertz"]).arrays
    assert [case_of(g) for g in with_content(groups, "normal")] == [
        Case(load=50.0),
        Case(load=200.0),
    ]
    assert [case_of(g) for g in with_content(groups, "cycle")] == [
        Case(load=F0, ratio=0.75) for F0 in (50.0, 200.0)
    ]
    pads = _folder(folders["asymmetric"]).arrays
    found = {
        (g.attributes["patch"], case_of(g).direction, case_of(g).ratio)
        for g in with_content(pads, "tangential")
    }
    assert found == {(side, axis, 0.5) for side in ("left", "right") for axis in "xy"}


def test_closed_forms_of_the_normal_contact(hertz: RunFolder) -> None:
    modulus = contact_modulus(E, NU, E, NU)
    for group in with_content(hertz.arrays, "normal"):
        point = hertz_sphere(case_of(group).load or 0.0, RADIUS, modulus)
        for name in ("radius", "max_pressure"):
            assert scalar(group, f"hertz_{name}") == pytest.approx(getattr(point, name), rel=1e-14)
    (curve,) = with_content(hertz.arrays, "force-approach")
    expected = [
        0.0,
        *(
            hertz_sphere(float(N), RADIUS, modulus).approach
            for N in curve["hertz_normal_force"].data[1:]
        ),
    ]
    np.testing.assert_allclose(curve["hertz_approach"].data, expected, rtol=1e-14)


def test_closed_forms_of_the_tangential_contact(hertz: RunFolder) -> None:
    a = hertz_sphere(F, RADIUS, contact_modulus(E, NU, E, NU)).radius
    C = tangential_compliance_modulus(E, NU, E, NU)
    group = next(g for g in with_content(hertz.arrays, "tangential") if case_of(g).load == F)
    c = float(mindlin.stick_radius(0.5 * MU * F, MU, F, a))
    assert scalar(group, "mindlin_stick_radius") == pytest.approx(c, rel=1e-14)
    x, q = group["mindlin_x"].data, group["mindlin_traction"].data
    np.testing.assert_allclose(q, mindlin.traction(np.abs(x), a, c, MU, F), rtol=1e-14)
    loop = next(g for g in with_content(hertz.arrays, "cycle") if case_of(g).load == F)
    d, T = loop["mindlin_displacement"].data, loop["mindlin_force"].data
    down, up = np.split(np.arange(len(T)), 2)
    np.testing.assert_allclose(
        d[down], mindlin.unloading(T[down], 0.75 * MU * F, MU, F, a, C), rtol=1e-14
    )
    np.testing.assert_allclose(
        d[up], mindlin.reloading(T[up], 0.75 * MU * F, MU, F, a, C), rtol=1e-12, atol=1e-18
    )


def test_what_a_dampers_charts_draw_lies_in_the_file(folders: dict[str, RunResult]) -> None:
    found = _folder(folders["symmetric"])
    for path in with_content(found.arrays, "path"):
        case = case_of(path)
        assert scalar(path, "friction_limit") == pytest.approx(MU * (case.load or 0.0), rel=1e-14)
