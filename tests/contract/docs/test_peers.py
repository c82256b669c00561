"""Benchmarks beside other codes: what they say without them, and what they make of an answer."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

PEERS = Path(__file__).resolve().parents[3] / "benchmarks" / "peers"
#: benchmark -> what its one row names when the other code is not there
NEEDS = {
    "bench_pyharm_response": "pip install pyHarm-os",
    "bench_tmdsimpy_response": "clone github.com/tmd-lab/tmdsimpy",
    "bench_octave_response": "apt-get install octave",
}
#: a code that answers with a curve up to the frequency given as its argument
ANSWER = """
import json, sys
problem = json.load(sys.stdin)

def curve():
    '''Counted without this.'''
    f = [problem["sweep"][0], 163.0, float(sys.argv[1])]  # and with this

    return f, [1e-5, 2.2733e-4, 2e-5]

f, a = curve()
print("told before")
print(json.dumps({"frequency": f, "amplitude": a, "seconds": 0.3, "version": "any 1.0"}))
"""


def loaded(monkeypatch: pytest.MonkeyPatch, name: str) -> Any:
    """A module of the folder; what it puts on the path is taken off again."""
    monkeypatch.setattr(sys, "path", [str(PEERS), str(PEERS.parent), *sys.path])
    spec = importlib.util.spec_from_file_location(f"peers_{name}", PEERS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
    return module


def test_nonlinear_modes_without_other_codes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ours are measured, with the values by shooting beside them; two rows say what to install."""
    module = loaded(monkeypatch, "bench_nonlinear_modes")
    monkeypatch.setattr(module, "ROUNDS", 1)
    monkeypatch.setattr(module, "RIGS", ())
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("UPD_TMDSIMPY", raising=False)
    rows = list(module.run())
    skipped = [row["note"] for row in rows if row.get("case") == "skipped"]
    assert "clone github.com/tmd-lab/tmdsimpy" in skipped[0]
    assert "apt-get install octave" in skipped[1]
    hertz = [row for row in rows if row["name"] == "frequency"]
    assert len(hertz) == 6
    for row in hertz:
        assert float(row["value"]) == pytest.approx(float(row["target"]), rel=1e-4)
    assert all(row["value"] > 0.0 for row in rows if row["name"] == "time_point")


@pytest.mark.parametrize(("name", "install"), NEEDS.items())
def test_without_the_other_code_one_row_says_what_to_install(
    name: str, install: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = loaded(monkeypatch, name)
    monkeypatch.setenv("PATH", "")
    monkeypatch.setenv("UPD_PEERS", "no-such-interpreter")
    monkeypatch.delenv("UPD_TMDSIMPY", raising=False)
    (row,) = module.run()
    assert row["case"] == "skipped"
    assert install in row["note"]
    assert "value" not in row, "a skipped benchmark leaves its earlier rows"


def test_the_other_code_gets_our_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same forces in time, and a start that is the linear answer of stuck contacts."""
    pair = loaded(monkeypatch, "side_by_side")
    p = {key: np.array(value) for key, value in pair.problem().items()}
    turn = np.exp(0.7j)
    assert np.allclose((pair.public.HARMONIC * turn).real, p["sine"] * turn.imag)
    rows = np.vstack([p["normal"], p["tangent"]])
    K = p["K"] + rows.T @ np.diag([p["k_n"]] * 2 + [p["k_t"]] * 2) @ rows
    w = 2 * np.pi * p["sweep"][0]
    static, cos, sin = p["start"][:3]
    assert np.allclose(K @ static, p["static"])
    assert np.allclose((K - w**2 * p["M"]) @ sin - w * p["C"] @ cos, p["sine"])
    assert np.allclose((K - w**2 * p["M"]) @ cos + w * p["C"] @ sin, 0.0, atol=1e-9)


def test_rows_of_an_answer(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pair = loaded(monkeypatch, "side_by_side")
    monkeypatch.setenv("UPD_PEERS", sys.executable)
    script = tmp_path / "answer.py"
    script.write_text(ANSWER, encoding="utf-8")
    other = pair.theirs(script, ("curve",), "240")
    assert (other.points, other.frequency, other.peak) == (3, 163.0, 2.2733e-4)
    assert other.lines == 3, "def, f, return"
    own = pair.Measured(300, 162.96, 2.2733e-4, 0.6, 18)
    rows = {
        (row["name"], row["case"]): row["value"] for row in pair.rows({"any": (other, "")}, own)
    }
    assert rows["ratio_time_point", "any / upd"] == pytest.approx(0.1 / 2e-3)
    assert rows["track_peak", "any"] == "227.33"
    with pytest.raises(pair.SideBySideError, match=r"stopped at 200\.00 Hz"):
        pair.theirs(script, ("curve",), "200")
    with pytest.raises(pair.SideBySideError, match="IndexError"):
        pair.theirs(script, ("curve",))


def test_lines_of_the_original_are_those_it_calls(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The script and, through each other, the functions beside it; no comments, nobody else's."""
    module = loaded(monkeypatch, "bench_octave_response")
    texts = {
        "main": "% FREE is not called\n\nx = ONE(1);\n",
        "ONE": "function y = ONE(x)  % ONE\n  y = TWO(x);\nend\n",
        "TWO": "function y = TWO(x)\n  y = x;\n",
        "FREE": "function y = FREE(x)\n",
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.m").write_text(text, encoding="utf-8")
    assert module.written(tmp_path / "main.m") == 1 + 3 + 2
