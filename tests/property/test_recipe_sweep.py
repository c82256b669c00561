"""Random parameters of every ready recipe: a sound mesh, or one clear error that names them.

Sound: positive Jacobians, paired contact nodes, the volumes of the closed forms, all sets, the
nodes and elements that were counted. Two thousand sets are a benchmark.
"""

from __future__ import annotations

import importlib.util
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from geometry.blade_rig_params import BladeRig
from upd.errors import InputError
from upd.mesh.recipe_modules import READY

SWEEP = Path(__file__).resolve().parents[2] / "benchmarks" / "recipe_sweep.py"
#: sets of all recipes together
COUNT = 200


@pytest.fixture(scope="module")
def recipe_sweep() -> Any:
    spec = importlib.util.spec_from_file_location("recipe_sweep", SWEEP)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("recipe", READY)
def test_each_set_is_sound_or_refused(recipe: str, recipe_sweep: Any) -> None:
    found = list(recipe_sweep.sweep(recipe, COUNT // len(READY), seed=1, most=1200))
    wrong = [o for o in found if o.verdict not in ("sound", "refused")]
    assert not wrong, "\n".join(f"{o.verdict}: {dict(o.given)}" for o in wrong)
    count = Counter(o.verdict for o in found)
    assert min(count["sound"], count["refused"]) >= 2, count


def test_a_core_over_the_start_of_the_patch_is_refused() -> None:
    """Found by the sweep: the lines of the contact crossed the core's side, elements inverted."""
    steep = {"front_angle": 57.687, "front_halfwidth": 14.917, "shank_tx": 10.494}
    patch = {"patch_length": 16.08, "patch_offset": 1.357, "pitch": 72.2}
    with pytest.raises(InputError, match=r"core_tx: 11\.38 mm reaches over the start of the patch"):
        BladeRig(**steep, **patch)
