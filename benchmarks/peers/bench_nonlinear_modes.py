"""Damped nonlinear modes: ours and other codes, frequency, damping and seconds a point.

The third mode of the blade-damper-blade problem by tmdsimpy (see bench_tmdsimpy_response.py for its
folder and interpreter), and a Jenkins element by NLvib in Octave, which has no friction under a
normal load that varies: clone github.com/maltekrack/NLvib (NLvib - Basic) and let UPD_NLVIB name
the folder. Nothing of either is kept here. Seconds are those of the processor, one thread.

UPD_NLVIB=~/NLvib UPD_TMDSIMPY=~/tmdsimpy UPD_PEERS=peers/bin/python \
    python benchmarks/peers/bench_nonlinear_modes.py
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from upd.analyses import make_plan
from upd.analyses.forced.curves import linear_of
from upd.analyses.forced.model import make_model
from upd.analyses.forced.performance import mode_over_amplitude
from upd.analyses.forced.statics import face_laws, static_state
from upd.analyses.seated.bodies import make_bodies
from upd.hbm import NonlinearMode, System, contacts, nonlinear_mode
from upd.progress import Stages, silent
from upd.scene import load_scene

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parent))
import bench_tmdsimpy_response as tmdsimpy
import blade_damper_blade as public
import side_by_side as pair

FOLDER = "UPD_NLVIB"
SCRIPT = pair.HERE / "tmdsimpy_mode.py"
HARMONICS, SAMPLES, ROUNDS = 9, 256, 5
#: amplitudes of modes 3 and 2; Hz and damping in per cent by shooting at a log10 of the amplitude
ENDS = {3: (1e-6, 10**-3.4), 2: (1e-6, 10**-3.2)}
SHOOTING = {-4.0: (222.9916, 2.1716), -3.8: (212.9318, 4.6632), -3.6: (207.1169, 4.1153)}
#: the same of m = k = 1 with k_t = .25, mu N = 1, frequency in rad/s
JENKINS = {8.0: (1.0607723, 3.53544), 20.0: (1.0175799, 2.46503), 80.0: (1.0023186, 0.75299)}
MILLISECONDS, SECONDS = 1.0, 5.0
RIGS = ("asymmetric-response", "symmetric-response")
#: way to a point, as ln of the amplitude, from which a value is read
LONGEST = 0.05
#: NLvib finds an option of MATLAB by its handle, Octave by its name; the amplitude of the mode is
#: that of all harmonics there
COMMAND = """
addpath('{folder}/SRC'); addpath('{folder}/SRC/MechanicalSystems');
jenkins = struct('type', 'elasticDryFriction', 'stiffness', .25, 'friction_limit_force', 1, ...
    'ishysteretic', true, 'force_direction', 1);
one = SingleMassOscillator(1, 0, 1, {{jenkins}});
H = {harmonics}; start = zeros(2*H + 1, 1); start(2) = 1;
options = optimset(optimset('fsolve'), 'Display', 'off', 'Jacobian', 'on', 'MaxIter', 50);
begin_s = cputime();
X = solve_and_continue([start; sqrt(1.25); 0], ...
    @(X) HB_residual(X, one, H, {samples}, 'NMA', 1, 1), log10(4.1), log10(100), .02, ...
    struct('dsmax', .05), [], options);
seconds = cputime() - begin_s;
printf('seconds %.17g\\n', seconds);
a = 10.^X(end, :) .* hypot(X(2, :), X(3, :));
printf('point %.17g %.17g %.17g\\n', [a; X(end-2, :); X(end-1, :)]);
"""
Row = pair.Row


def ours(of: Callable[[], NonlinearMode]) -> tuple[NonlinearMode, float]:
    """A mode and its seconds a point."""
    seconds = []
    with threadpool_limits(1):
        for _ in range(ROUNDS + 1):
            begin = time.process_time()
            found = of()
            seconds.append(time.process_time() - begin)
    return found, min(seconds[1:]) / len(found.amplitude)


def benchmark(mode: int) -> NonlinearMode:
    """A mode of the blade-damper-blade problem."""
    return nonlinear_mode(
        System(
            (public.M, public.C, public.stiffness()),
            public.wedge(),
            harmonics=range(HARMONICS + 1),
            samples=SAMPLES,
            static_force=public.STATIC,
        ),
        mode=mode,
        amplitudes=np.geomspace(*ENDS[mode], 40),
    )


def oscillator() -> NonlinearMode:
    """m = k = 1 with a Jenkins element."""
    slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=0.25, mu=1.0, preload=1.0)
    return nonlinear_mode(
        System(([[1.0]], [[0.0]], [[1.0]]), slider, samples=1024),
        mode=1,
        amplitudes=np.union1d(np.geomspace(4.1, 100.0, 40), [*JENKINS]),
    )


def rows(code: str, curve: Any, known: dict[float, Any], seconds: float) -> Iterator[Row]:
    """Frequency and damping ratio of a curve (amplitude, frequency, damping), and seconds."""
    a, f, zeta = (np.asarray(one) for one in curve)
    for at, (frequency, per_cent) in known.items():
        # no value is read from a step that long
        if np.abs(np.log(a / at)).min() > LONGEST:
            continue
        near = (np.interp(np.log(at), np.log(a), one) for one in (f, 100.0 * zeta))
        named = zip(("frequency", "damping"), near, (frequency, per_cent), strict=True)
        for name, value, target in named:
            yield {"name": name, "case": f"{code}, {at:.3g}", "value": f"{value:.6g}",
                   "target": f"{target:.6g}", "note": "shooting; read between points"}  # fmt: skip
    yield {"name": "time_point", "case": code, "value": 1e3 * seconds, "unit": "ms",
           "note": f"{len(a)} points"}  # fmt: skip


def of_tmdsimpy() -> Iterator[Row]:
    """Mode 3 of the blade-damper-blade problem by both."""
    mode, own = ours(lambda: benchmark(3))
    known = {10.0**log_a: values for log_a, values in SHOOTING.items()}
    curve = (mode.amplitude, mode.frequency, mode.damping)
    yield from rows("upd, benchmark mode 3", curve, known, own)
    if why := tmdsimpy.missing():
        yield from pair.skipped("tmdsimpy", why)
        return
    b, shape = mode.balance, mode.stuck[:, mode.number]
    given = {
        **pair.problem(),
        "harmonics": HARMONICS,
        "shape": (b.modal.Phi @ shape).tolist(),
        "omega": float(mode.stuck_omega[mode.number]),
        "xi": float(4.0 * np.pi * mode.frequency[0] * mode.damping[0]),
        "low": -6.0,
        "high": -3.4,
    }
    folder = str(Path(os.environ[tmdsimpy.FOLDER]).expanduser().resolve())
    found = pair.answer_of(SCRIPT, given, folder)
    a, omega, zeta = (np.array(found[name]) for name in ("log_a", "omega", "zeta"))
    theirs = found["seconds"] / len(a)
    yield from rows("tmdsimpy, benchmark mode 3", (10.0**a, omega / 2 / np.pi, zeta), known, theirs)
    yield {"name": "ratio_time_point", "case": "tmdsimpy / upd", "value": theirs / own,
           "unit": "times"}  # fmt: skip


def of_nlvib() -> Iterator[Row]:
    """The Jenkins element by both."""
    mode, own = ours(oscillator)
    curve = (mode.amplitude, 2 * np.pi * mode.frequency, mode.damping)
    yield from rows("upd, Jenkins", curve, JENKINS, own)
    folder = os.environ.get(FOLDER)
    if shutil.which("octave") is None or not folder:
        yield from pair.skipped("NLvib", f"apt-get install octave; {FOLDER} names its folder")
        return
    path = Path(folder).expanduser().resolve()
    code = COMMAND.format(folder=path, harmonics=HARMONICS, samples=1024)
    done = subprocess.run(
        ["octave", "--no-gui", "--quiet", "--no-init-file", "--eval", code],
        env={**os.environ, **pair.ONE_THREAD},
        capture_output=True,
        text=True,
        timeout=pair.PATIENCE,
    )
    lines = [line.split() for line in done.stdout.splitlines()]
    points = np.array([[*map(float, line[1:])] for line in lines if line[:1] == ["point"]])
    if not len(points):
        words = " ".join(done.stderr.split())[-300:]
        raise pair.SideBySideError(f"octave ended with: {words}")
    (seconds,) = (float(line[1]) for line in lines if line[:1] == ["seconds"])
    theirs = seconds / len(points)
    yield from rows("NLvib, Jenkins", points.T, JENKINS, theirs)
    yield {"name": "ratio_time_point", "case": "NLvib / upd", "value": theirs / own,
           "unit": "times"}  # fmt: skip


def of_rig(name: str) -> Iterator[Row]:
    """Both modes of a ready rig, once it is reduced: seconds of each, as a run solves them beside
    each other.
    """
    plan: Any = make_plan(load_scene(name))
    bodies = make_bodies(plan)
    for stiffness, choice in plan.scene.stiffnesses.items():
        laws = face_laws(choice, Stages(silent))
        model = make_model(plan, bodies, laws, static_state(plan, bodies))
        linear = linear_of(plan, model)
        for in_phase in (True, False):
            with threadpool_limits(1):
                begin = time.process_time()
                case, found = mode_over_amplitude(plan, model, linear, stiffness, in_phase)
                seconds = time.process_time() - begin
            frequency = found["frequency"]
            yield {
                "name": "time_mode",
                "case": f"{name}, {case.mode}",
                "value": seconds,
                "unit": "s",
                "target": SECONDS,
                "note": f"{len(frequency.data)} points; {frequency.attributes['message']}",
            }


def run() -> Iterator[Row]:
    """Seconds a point of both benchmark modes, seconds of the rigs; then the other codes."""
    for number in ENDS:
        mode, seconds = ours(lambda number=number: benchmark(number))
        yield {
            "name": "time_point",
            "case": f"upd, benchmark mode {number}, harmonics 0 to {HARMONICS}, {SAMPLES} samples",
            "value": 1e3 * seconds,
            "unit": "ms",
            "target": MILLISECONDS,
            "note": f"{len(mode.amplitude)} points; {1e3 * seconds / MILLISECONDS:.2f} times it",
        }
    for name in RIGS:
        yield from of_rig(name)
    yield from of_tmdsimpy()
    yield from of_nlvib()


if __name__ == "__main__":
    for row in run():
        print(row)
