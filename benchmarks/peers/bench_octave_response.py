"""Side by side with the Octave original of the blade-damper-blade problem (N. Balaji, "nonuniq").

Runs when `octave` is installed and UPD_NONUNIQ names the script that computes the curve, in a copy
of the original scripts (github.com/Nidish96/nonuniq, a_hbfresp.m); their licence and layout are
theirs, so nothing of them is kept here. Otherwise one row says what to install.

UPD_NONUNIQ=~/nonuniq/a_hbfresp.m python benchmarks/peers/bench_octave_response.py
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parent))
import side_by_side as pair

SCRIPT = "UPD_NONUNIQ"
#: The script as found, in the names it gives its results. Its last lines draw: what fails there,
#: where no graphics are installed, is nothing to the curve. Seconds of the processor, its start
#: taken off.
COMMAND = """
begin_s = cputime(); setenv('UPD_BEGIN', num2str(begin_s, 17));
try, run('{name}'), catch fault, disp(fault.message), end
seconds = cputime() - str2double(getenv('UPD_BEGIN'));
printf('curve %d %d %.17g\\n', max(h), Nt, seconds);
printf('point %.17g %.17g\\n', [UwC(end, :) / (2 * pi); hypot(UwC(rinds(4), :), UwC(iinds(4), :))]);
"""


def missing() -> str:
    """Why the original cannot run here, empty when it can."""
    if shutil.which("octave") is None:
        return "octave is not on the path: apt-get install octave"
    given = os.environ.get(SCRIPT)
    if not given:
        return f"{SCRIPT} is not set: clone github.com/Nidish96/nonuniq and let it name a_hbfresp.m"
    return "" if Path(given).expanduser().is_file() else f"{SCRIPT} names {given}, which is no file"


def written(script: Path) -> int:
    """Lines of code of the script and of the functions beside it that it calls."""
    beside = {path.stem: path for path in script.parent.glob("*.m")}
    found, open_ = {script.stem}, [script]
    count = 0
    while open_:
        text = open_.pop().read_text(encoding="utf-8", errors="replace")
        code = [line.split("%")[0] for line in text.splitlines()]
        count += sum(bool(line.strip()) for line in code)
        called = set(re.findall(r"\w+", "\n".join(code))) & set(beside) - found
        found |= called
        open_ += [beside[name] for name in called]
    return count


def original(script: Path) -> pair.Measured:
    """The curve of the script in a fresh Octave without windows.

    Raises SideBySideError when it ended without a curve over the whole range, or with other
    harmonics and samples.
    """
    command = ["octave", "--no-gui", "--quiet", "--no-init-file", "--eval"]
    try:
        done = subprocess.run(
            [*command, COMMAND.format(name=script.name)],
            cwd=script.parent,
            env={**os.environ, **pair.ONE_THREAD},
            capture_output=True,
            text=True,
            timeout=pair.PATIENCE,
        )
    except subprocess.TimeoutExpired:
        raise pair.SideBySideError(f"octave was stopped after {pair.PATIENCE} s") from None
    # Octave without graphics ends with an error after the curve is printed: its code tells nothing.
    lines = [line.split() for line in done.stdout.splitlines()]
    head = [line[1:] for line in lines if line[:1] == ["curve"]]
    points = [(float(line[1]), float(line[2])) for line in lines if line[:1] == ["point"]]
    if not head or not points:
        raise pair.SideBySideError(f"octave ended with: {' '.join(done.stderr.split())[-300:]}")
    if (int(head[0][0]), int(head[0][1])) != (pair.HARMONICS, pair.SAMPLES):
        raise pair.SideBySideError(f"{script.name} has harmonics, samples {head[0][:2]}")
    return pair.measured(points, float(head[0][2]), written(script))


def run() -> list[pair.Row]:
    """Rows of the benchmark; one row that says why when the original is not there."""
    why = missing()
    if why:
        return pair.skipped("octave", why)
    script = Path(os.environ[SCRIPT]).expanduser().resolve()
    told = "script, residual and contact law, matrices and figure included"
    return list(pair.rows("Octave original", original(script), pair.ours(), told))


if __name__ == "__main__":
    for row in run():
        print(row)
