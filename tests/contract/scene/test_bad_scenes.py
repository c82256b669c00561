"""Bad and odd scenes, generated over the schema of the ready scenes.

Exit code 2, one message with fault and remedy, nothing left.
"""

from __future__ import annotations

import contextlib
import io
import sys
import tomllib
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from tomli_w import dumps as to_toml

from upd import cli, load_scene, make_plan
from upd.errors import InputError
from upd.scene import ForcedScene, RigScene, Scene, SeatedScene, ready_scenes

#: what the whole set must hold
WANTED = 300
#: examples per ready scene and kind of fault
EACH = 10
#: keys that take any text in quotes, the second ones because only the mesh knows its sets
FREE_TEXT = ("title", "contact.distant.damper", "contact.distant.platform")
SCHEMAS: dict[str, Any] = {
    "hertz": Scene,
    "symmetric": Scene,
    "asymmetric": Scene,
    "rig": RigScene,
    "symmetric-response": ForcedScene,
    "asymmetric-response": ForcedScene,
    "symmetric-seated": SeatedScene,
    "asymmetric-seated": SeatedScene,
}
#: TOML that no key of a scene takes
NEVER = (
    "nan",
    "inf",
    "-inf",
    '"nan mm"',
    '"inf N"',
    "[[[]]]",
    "[{}]",
    "{ a = 1 }",
    "1979-05-27",
    "07:32:00",
    '"5 kg"',
    '"5 furlong"',
    "[true]",
    '[""]',
    '["5 mm", 5]',
    "[nan]",
    "-7",
    '"-1 N"',
    '"1 mm mm"',
    '"0x10 mm"',
    '"1e5000 mm"',
    "1" + 400 * "0",
)
#: TOML that some keys take and others do not
ODD = (
    "0",
    "1",
    "2",
    "1000000000",
    "0.0",
    "1e300",
    "1e-300",
    '""',
    "true",
    "[]",
    '"auto"',
    '"0 mm"',
    '"1e300 mm"',
    '"1e-300 mm"',
    '"1e300 N"',
    '"1e-300 N"',
    '"1e300 GPa"',
    '"1e-300 Pa"',
    '"1e9 Hz"',
    '"1e-9 Hz"',
    '"50 %"',
    '["1e300 N"]',
    '["0 N"]',
    "[1e-300]",
    '"all"',
    "[0, 1]",
    '"../../x"',
    '"\\u0000"',
    '"[red]x[/red]"',
    '"[/]"',
    '"$(reboot)"',
    '"µ 🦋"',
    '"' + 5000 * "x" + '"',
)
#: every analysis: values that each mean something and do not go together
CONTRADICTORY: dict[str, tuple[dict[str, str], ...]] = {
    "hertz": (
        {"geometry.divisions": '"auto"'},
        {"geometry.patch": '"9 mm"'},
        {"geometry.symmetry": '"full"'},
        {"contact.directions": "2", "mesh.symmetry": '"quarter"'},
        {"loads.normal": '["opposing"]'},
        {"loads.normal": '["50 N", "0.05 kN"]'},
        {"contact.distant": '{ block = "opposite" }'},
        {"law.rows": "3"},
        {"want": '["contact_law"]'},
        {"materials.third": '{ E = "200 GPa", nu = 0.3 }'},
    ),
    "symmetric": (
        {"contact.distant": '{ wedge = "bands" }'},
        {"loads.curve_to": '"0 N"'},
        {"loads.directions": '["x", "0 deg"]'},
        {"geometry.recipe": '"sphere_block"'},
        {"mesh.symmetry": '"quarter"'},
        {"want": '["body_compression"]'},
    ),
    "rig": (
        {"response.start": '"700 Hz"'},
        {"modes.below": '"300 Hz"'},
        {"mesh.symmetry": '"quarter"'},
        {"solver.name": '"amg"'},
        {"modes.arrangements": '["symmetric", "symmetric"]'},
        {"reduction.modes": "3", "reduction.error": '"1 %"'},
        {"want": '["matrices"]'},
        {"geometry.recipe": '"wedge_platform"'},
    ),
    "symmetric-response": (
        {"excitation.start": '"600 Hz"'},
        {"excitation.centrifugal_to_force": "[194.0, 194.0]"},
        {"damper.centrifugal": '"0 N"'},
        {"mesh.symmetry": '"quarter"'},
        {"balance.samples": "8", "balance.harmonics": "7"},
        {"performance.lowest": "2000.0"},
        {"contact.stiffness": '["none"]'},
        {"stiffness.own.run": '"runs/none"'},
        {"stiffness.own.K_N": '"1e6 N/mm"'},
        {"stiffness.thesis.points": '"law"'},
        {"analysis": '"modes"'},
        {"geometry.recipe": '"sphere_block"'},
    ),
}


@dataclass
class Tally:
    """Scenes of the whole set and what became of them.

    Refused ones were also given to `upd run`.
    """

    refused: int = 0
    planned: int = 0
    texts: set[str] | None = None


TALLY = Tally(texts=set())


def schema(cls: Any, tables: dict[str, Any], prefix: str = "") -> Iterator[str]:
    """Paths of all keys of a scene's class, those no ready scene gives included."""
    hints = typing.get_type_hints(cls)
    for f in fields(cls):
        if f.name == "text" or f.name == "TABLES":
            continue
        path, kind, inside = f"{prefix}{f.name}", hints[f.name], tables.get(f.name)
        yield path
        table = next((k for k in (kind, *typing.get_args(kind)) if is_dataclass(k)), None)
        if typing.get_origin(kind) is Mapping:
            for key, value in (inside or {}).items():
                yield from schema(table, value, f"{path}.{key}.") if table else [f"{path}.{key}"]
        elif table:
            yield from schema(table, inside or {}, f"{path}.")


def tables_of(name: str) -> dict[str, Any]:
    return tomllib.loads(ready_scenes()[name].read_text(encoding="utf-8"))


PATHS = {name: sorted(set(schema(cls, tables_of(name)))) for name, cls in SCHEMAS.items()}


def with_values(name: str, values: dict[str, str]) -> str:
    """The ready scene's text with some values, given as TOML, in place of its own."""
    tables = tables_of(name)
    for k, path in enumerate(values):
        *parents, last = path.split(".")
        node = tables
        for key in parents:
            node = node.setdefault(key, {})
        node[last] = f"@held{k}@"
    text = to_toml(tables)
    for k, value in enumerate(values.values()):
        text = text.replace(f'"@held{k}@"', value)
    return text


def without(name: str, path: str) -> str:
    tables = tables_of(name)
    *parents, last = path.split(".")
    node = tables
    for key in parents:
        node = node[key]
    del node[last]
    return to_toml(tables)


def present(name: str) -> list[str]:
    def walk(table: dict[str, Any], prefix: str = "") -> Iterator[str]:
        for key, value in table.items():
            yield prefix + key
            if isinstance(value, dict):
                yield from walk(value, f"{prefix}{key}.")

    return list(walk(tables_of(name)))


def misspelt(path: str, k: int) -> str:
    """Two neighbouring letters of the key swapped, or one doubled where they are the same."""
    head, _, key = path.rpartition(".")
    k = k % max(1, len(key) - 1)
    swapped = key[:k] + key[k + 1 : k + 2] + key[k] + key[k + 2 :]
    return f"{head}{'.' * bool(head)}{swapped if swapped != key else key + key[-1]}"


def values_of(name: str, kind: str) -> st.SearchStrategy[dict[str, str]]:
    """Values given as TOML to one key of a scene, or to several."""
    paths = st.sampled_from(PATHS[name])
    if kind == "several":
        some = st.dictionaries(paths, st.sampled_from(NEVER + ODD), min_size=2, max_size=4)
        return some.filter(
            lambda values: not any(b.startswith(f"{a}.") for a in values for b in values)
        )
    if kind == "misspelt":
        found = st.builds(misspelt, st.sampled_from(present(name)), st.integers(0, 20))
        return found.filter(lambda path: path not in PATHS[name]).map(lambda path: {path: "1"})
    return st.builds(
        lambda path, value: {path: value}, paths, st.sampled_from(NEVER if kind == "never" else ODD)
    )


def called(*arguments: str) -> tuple[int, str]:
    """Exit code and what stands on the error stream."""
    told = io.StringIO()
    with (
        contextlib.redirect_stderr(told),
        contextlib.redirect_stdout(io.StringIO()),
        pytest.raises(SystemExit) as end,
    ):
        cli.main(list(arguments))
    return int(end.value.code or 0), told.getvalue()


def examine(text: str, place: str, refused: bool) -> None:
    """Plan the scene; when it is refused, run it too and find nothing of that run."""
    assert TALLY.texts is not None
    if text in TALLY.texts:
        return
    Path("scene.toml").write_text(text, encoding="utf-8")
    code, told = called("plan", "scene.toml")
    assert code in (0, 2), told
    assert code == 2 or not refused, f"{place}: planned, though it cannot be\n{text}"
    if code == 2:
        _is_message(told, place)
        assert called("run", "scene.toml", "--out", "never") == (code, told)
    else:
        assert not told
    assert [p.name for p in Path.cwd().iterdir()] == ["scene.toml"], "half-written"
    TALLY.texts.add(text)
    TALLY.refused += code == 2
    TALLY.planned += code == 0


def _is_message(told: str, place: str) -> None:
    assert told.startswith("upd: ")
    assert told.count("upd: ") == 1
    for word in ("Traceback", "validation error", "pydantic", "Error:", "<class", "0x7f"):
        assert word not in told, told
    words = [part for key in place.split(" ") for part in key.split(".")]
    assert any(word in told for word in words), f"{place} is not named:\n{told}"
    assert max(map(len, told.splitlines())) < 1200, "a message a terminal can show"


@pytest.fixture(autouse=True)
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("kind", ["never", "odd", "several", "misspelt"])
@pytest.mark.parametrize("name", list(SCHEMAS))
def test_generated_scenes(name: str, kind: str) -> None:
    @settings(
        max_examples=EACH,
        derandomize=True,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.generate],
    )
    @given(values_of(name, kind))
    def check(values: dict[str, str]) -> None:
        refused = kind == "misspelt" or (
            kind == "never"
            and not any(path in FREE_TEXT and text[0] == '"' for path, text in values.items())
        )
        examine(with_values(name, values), " ".join(values), refused)

    check()


@pytest.mark.parametrize("name", ["hertz", "rig", "symmetric-response"])
def test_missing_keys(name: str) -> None:
    for path in present(name):
        examine(
            without(name, path),
            path,
            path
            in ("name", "want", "geometry", "materials", "material", "loads", "geometry.recipe"),
        )


@pytest.mark.parametrize(
    ("name", "values"), [(name, values) for name, sets in CONTRADICTORY.items() for values in sets]
)
def test_contradictory_values(name: str, values: dict[str, str]) -> None:
    examine(with_values(name, values), " ".join(values), True)


@pytest.mark.parametrize(
    "path",
    [
        "contact.friction",
        "geometry.radius",
        "loads.normal",
        "name",
        "contact",
        "want",
        "materials.sphere.E",
    ],
)
@pytest.mark.parametrize(
    "value",
    [
        None,
        object(),
        b"5 mm",
        3 + 1j,
        {1, 2},
        Path("x y"),
        np.float64("nan"),
        np.arange(2.0),
        np.bool_(True),
        [None],
        {None: 3},
    ],
)
def test_values_from_python(path: str, value: object) -> None:
    """A mapping can hold what TOML cannot."""
    with pytest.raises(InputError) as caught:
        make_plan(load_scene("hertz", {path: value}))
    assert path.split(".")[-1] in str(caught.value)


@pytest.mark.parametrize("source", [None, 3, b"hertz", ["hertz"], "", ".", "\0", 5000 * "x"])
def test_sources_that_are_no_scenes(source: Any) -> None:
    with pytest.raises(InputError, match="no scene"):
        load_scene(source)


def test_overrides_that_are_none() -> None:
    assert load_scene("hertz", "contact.friction=0.3") == load_scene(
        "hertz", ["contact.friction=0.3"]
    )
    overrides: tuple[Any, ...] = ([3], [""], {1: 2}, {"": 1}, {"geometry..x": 1})
    for given_overrides in overrides:
        with pytest.raises(InputError, match="1 problem"):
            load_scene("hertz", given_overrides)


def test_count_of_the_set(capsys: pytest.CaptureFixture[str]) -> None:
    """Last in this file: how many scenes the tests above have tried."""
    assert TALLY.texts is not None
    if not TALLY.texts:
        pytest.skip("the other tests of this file have not run")
    told = (
        f"{len(TALLY.texts)} bad and odd scenes: {TALLY.refused} refused, {TALLY.planned} planned"
    )
    with capsys.disabled():
        sys.stdout.write(f"\n{told}\n")
    assert TALLY.refused + TALLY.planned >= WANTED, told
    assert TALLY.refused >= 0.6 * WANTED, told
