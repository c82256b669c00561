"""What a plan says before anything is solved: size, seconds, bytes, and what is missing."""

import sys
import time
from pathlib import Path
from typing import Any

import pytest

from upd.analyses import analysis_of, make_plan
from upd.batch.engine import time_left
from upd.cli.app import main
from upd.errors import InputError
from upd.linalg import predict
from upd.linalg.select import SPEEDUP, Solid, threads_used
from upd.mesh import recipes
from upd.scene import load_scene
from upd.vary.solve import changed


def test_work_that_grows_is_predicted() -> None:
    """Steps of the cycle, loads and frequencies cost what each of them costs."""
    few, many = (make_plan(load_scene("hertz", {"loads.cycle_steps": n})) for n in (300, 100_000))
    # 150 us a step for two loads
    assert 20.0 < many.seconds - few.seconds < 60.0
    assert many.memory_bytes > few.memory_bytes
    loads = [f"{50 + k} N" for k in range(100)]
    assert make_plan(load_scene("hertz", {"loads.normal": loads})).seconds > 1.5 * few.seconds
    coarse, fine = (
        make_plan(load_scene("asymmetric-response", {"excitation.points": n})) for n in (100, 4000)
    )
    assert fine.seconds > coarse.seconds + 10.0


def test_time_left_follows_the_finished_points() -> None:
    """Two points of 10 s predicted and one of 40 s, two at a time."""
    expected = {0: 10.0, 1: 10.0, 2: 40.0}
    assert time_left([0, 1, 2], (), 0.0, 2, expected) == 30.0
    # the first took 20 s of the clock, twice its prediction
    assert time_left([0, 1, 2], (0,), 20.0, 2, expected) == 100.0
    assert time_left([0, 1, 2], (0, 1, 2), 60.0, 2, expected) == 0.0
    assert time_left([0, 1, 2], (), 5.0, 2) == float("inf")
    assert time_left([0, 1, 2], (0,), 5.0, 2) == 10.0


def test_factor_of_an_elongated_body_is_smaller() -> None:
    cube, bar = Solid.of(1000, 1331, 8), Solid.of(1000, 2 * 251 * 3, 8)
    assert cube.compactness == pytest.approx(1.1, abs=0.05)
    assert bar.compactness > cube.compactness
    costs = [predict(30_000, 0, "pardiso", one) for one in (cube, bar)]
    assert costs[1].factor_nnz < costs[0].factor_nnz
    assert costs[1].bytes < costs[0].bytes


@pytest.mark.parametrize("scene", ["hertz", "symmetric"])
def test_many_loads_are_planned_in_linear_time(scene: str) -> None:
    """Each was compared with all others: 20 000 loads took minutes, 5 000 ten seconds."""
    begin = time.process_time()
    plan = make_plan(
        load_scene(scene, {"loads.normal": [f"{50 + k * 0.001:.3f} N" for k in range(5_000)]})
    )
    assert time.process_time() - begin < 5.0
    assert plan.seconds > 250.0


@pytest.mark.parametrize(
    ("body", "name", "message"),
    [
        ("platform", "oposite", "the mesh has no set 'oposite'; known: opposite, sides"),
        ("plattform", "opposite", "no such body; the recipe makes damper, platform"),
    ],
)
@pytest.mark.parametrize("scene", ["symmetric", "asymmetric"])
def test_distant_sets_are_checked_by_the_plan(
    scene: str, body: str, name: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        make_plan(load_scene(scene, {f"contact.distant.{body}": name}))


@pytest.mark.parametrize("recipe", ["sphere_block", "wedge_platform", "pads_platform"])
def test_declared_distant_sets_are_those_of_the_mesh(recipe: str) -> None:
    scene = {"sphere_block": "hertz", "wedge_platform": "symmetric", "pads_platform": "asymmetric"}
    parameters = make_plan(load_scene(scene[recipe])).parameters
    meshes, _ = recipes.build_mesh(recipe, parameters)
    made = {
        body: {n.removeprefix("distant_") for n in mesh.nodes if n.startswith("distant_")}
        for body, mesh in meshes.items()
    }
    declared = recipes.sets_of(recipe, parameters, "DISTANT")
    assert {body: set(names) for body, names in declared.items()} == made


def test_recipe_of_a_user_is_announced_once_and_each_mesh_made_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Even where nothing can be kept on disk."""
    examples = Path(__file__).parents[3] / "upd/scenes/examples"
    source = (examples / "own_damper.py").read_text(encoding="utf-8")
    head = "def build(params: OwnDamper) -> dict[str, Mesh]:"
    assert head in source
    source = source.replace(head, f"{head}\n    print('MESHED', params)") + "\nprint('READ')\n"
    (tmp_path / "own_damper.py").write_text(source, encoding="utf-8")
    scene = tmp_path / "own_damper.toml"
    scene.write_text((examples / "own_damper.toml").read_text(encoding="utf-8"), encoding="utf-8")
    cache = str(tmp_path / "cache")
    # what lies on a disk is not kept in memory too: each time it is meshed
    for folder in (cache, "/proc/nowhere"):
        monkeypatch.setenv("UPD_CACHE", folder)
        for name in [n for n in sys.modules if n.startswith("upd_recipe_")]:
            monkeypatch.delitem(sys.modules, name)
        with pytest.raises(SystemExit):
            main(["plan", str(scene)])
        shown = capsys.readouterr()
        meshed = [line for line in shown.out.splitlines() if line.startswith("MESHED")]
        # no effect left out needs a coarser model
        assert len(meshed) == 1 and shown.out.splitlines().count("READ") == 1
        assert "runs the Python code of" in shown.err
    monkeypatch.setenv("UPD_CACHE", cache)
    for name in [n for n in sys.modules if n.startswith("upd_recipe_")]:
        monkeypatch.delitem(sys.modules, name)
    with pytest.raises(SystemExit):
        main(["plan", str(scene)])
    shown = capsys.readouterr()
    assert "runs the Python code of" not in shown.err
    assert "MESHED" not in shown.out


_COARSE = """
from geometry import wedge_platform
from geometry.wedge_platform import ANALYSIS, WedgePlatform, inclination

def build(params: WedgePlatform):
    if params.divisions < 10:
        raise ValueError("too coarse")
    return wedge_platform.build(params)
"""


def test_companion_of_a_user_s_recipe_is_coarser_where_it_can_be(tmp_path: Path) -> None:
    """Where the recipe cannot be coarser it is as fine as the run."""
    toy = {
        "mesh.element": "hex8",
        "geometry.divisions": 10,
        "geometry.divisions_long": 16,
        "loads.normal": ["opposing"],
        "want": ["normal", "tangential"],
    }
    (tmp_path / "any.py").write_text(_COARSE.replace("< 10", "< 1"), encoding="utf-8")
    (tmp_path / "fine.py").write_text(_COARSE, encoding="utf-8")
    ready = make_plan(load_scene("symmetric", toy)).companion
    assert ready is not None
    for name, divisions in (("any.py", 8), ("fine.py", 10)):
        recipe = str(tmp_path / name)
        plan = make_plan(load_scene("symmetric", toy | {"geometry.recipe": recipe}))
        assert plan.companion is not None and plan.symmetry == "half"
        assert plan.companion.parameters["divisions"] == divisions
        assert (plan.companion.size == ready.size) == (divisions == 8)


def test_plan_counts_runs_of_uncertain_inputs(capsys: pytest.CaptureFixture[str]) -> None:
    """Both ends of every interval on the companion, without its figures; said beside the total."""
    exact = {"accuracy": "unknown", "left_out.solve": "no"}
    one = exact | {"contact.friction": "0.6 +- 0.1"}
    two = one | {"loads.normal": ["50 N", "200 N +- 10 N"]}
    plans = [make_plan(load_scene("hertz", given)) for given in (exact, one, two)]
    assert [plan.input_seconds > 0.0 for plan in plans] == [False, True, True]
    analysis = analysis_of(plans[0].scene)
    coarse = analysis.make_plan(changed(plans[0].scene, analysis.coarsened(plans[0])))
    companion = coarse.seconds - coarse.files_seconds
    assert 0.0 < coarse.files_seconds < coarse.seconds
    for count, plan in enumerate(plans):
        assert plan.input_seconds == pytest.approx(2 * count * companion, rel=0.02)
        assert plan.seconds == pytest.approx(plans[0].seconds + plan.input_seconds)
    settings = ['--set=contact.friction="0.6 +- 0.1"', '--set=accuracy="unknown"']
    with pytest.raises(SystemExit):
        main(["plan", "hertz", *settings])
    told = " ".join(capsys.readouterr().out.split())
    assert "for the bands by 1 uncertain input," in told
    assert "error estimates" not in told


@pytest.mark.parametrize("recipe", ["sphere_block", "wedge_platform", "pads_platform"])
def test_declared_sets_with_weights_are_those_of_the_mesh(recipe: str) -> None:
    scene = {"sphere_block": "hertz", "wedge_platform": "symmetric", "pads_platform": "asymmetric"}
    parameters = make_plan(load_scene(scene[recipe])).parameters
    meshes, _ = recipes.build_mesh(recipe, parameters)
    made = {body: set(mesh.weights) for body, mesh in meshes.items() if mesh.weights}
    declared = recipes.sets_of(recipe, parameters, "WEIGHTED")
    assert {body: set(names) for body, names in declared.items()} == made


@pytest.mark.parametrize(("scene", "held"), [("symmetric", "base"), ("asymmetric", "bottom")])
def test_plan_counts_the_second_factor_of_a_damper_held_in_the_mean(scene: str, held: str) -> None:
    """Beside a condensation of each family, a factor alone and the tractions' right sides."""
    small = {"accuracy": "unknown", "left_out.solve": "no"}
    mean = make_plan(load_scene(scene, small))
    nodes = make_plan(load_scene(scene, small | {"contact.distant.damper": held}))
    count = mean.size["damper"]
    solid = Solid.of(count["hexes"], count["nodes"], 8)
    again = predict(3 * count["nodes"], 0, "pardiso", solid)
    gain = {1: 1.0}.get(threads_used(), SPEEDUP)
    assert gain * (mean.seconds - nodes.seconds) == pytest.approx(
        2.0 * (again.seconds + 5.0 * again.substitution()), rel=1e-6
    )


@pytest.mark.parametrize(
    ("scene", "changes"),
    [
        ("rig", {}),
        ("symmetric-response", {}),
        ("symmetric-response", {"contact.rule": "gauss", "contact.rows": 3, "contact.columns": 2}),
    ],
)
def test_modes_and_reductions_are_planned_with_a_factor(
    scene: str, changes: dict[str, object]
) -> None:
    """Multigrid has none: where memory is short the plan tells the bytes that the run will take."""
    short = {"solver.memory": "1 GB", "geometry.refine": 3}
    plan = make_plan(load_scene(scene, short | changes))
    assert all(told.partition(":")[0] in ("pardiso", "superlu") for told in plan.solver.values())
    assert plan.memory_bytes > 5e9


def test_samples_frequencies_and_modes_of_a_balance_cost() -> None:
    """Measured on 24 rows of Gauss points a face, graded x 1.5, harmonics to 7, seconds of the
    processor: 124; 150 with eight times the samples, 155 with twice the frequencies, 139 with forty
    modes for ten.
    """
    base = {
        "want": ["response"],
        "excitation.points": 400,
        "balance.harmonics": 7,
        "contact.rule": "gauss",
        "contact.rows": 24,
        "contact.columns": 2,
        "contact.stiffness": ["thesis"],
        "excitation.centrifugal_to_force": [194],
    }

    def seconds(**more: Any) -> float:
        changes = base | {key.replace("__", "."): value for key, value in more.items()}
        return make_plan(load_scene("symmetric-response", changes)).seconds

    usual = seconds()
    assert 1.1 < seconds(balance__samples=1024) / usual < 1.6
    assert 1.05 < seconds(excitation__points=799) / usual < 1.5
    assert 1.0 < seconds(reduction__modes=40) / usual < 1.2
