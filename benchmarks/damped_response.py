"""Draw benchmarks/accuracy/response_asymmetric.png.

What friction takes off a resonance (about a minute). Every lattice node has the same spring.

./run.sh python benchmarks/damped_response.py
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

import upd
from upd.results import read_netcdf

mpl.use("Agg")
from matplotlib import pyplot as plt

PICTURE = Path(__file__).parent / "accuracy" / "response_asymmetric.png"
#: F_C/F_E -> colour, from nearly sticking to sliding
CURVES = {600: "#1f5fa8", 194: "#d98200", 60: "#c0392b"}
CHANGES = {
    "contact.stiffness": ["thesis"],
    "contact.static": "frictionless",
    "contact.share": "equal",
    "want": ["response"],
    "excitation.centrifugal_to_force": [float(ratio) for ratio in CURVES],
    "excitation.stop": "470 Hz",
    "excitation.points": 600,
}


def height(accelerance: Any) -> NDArray[np.float64]:
    """Amplitude (n,) of real and imaginary parts (n, 2)."""
    return np.hypot(*np.asarray(accelerance, dtype=np.float64).T)


def draw(arrays: dict[str, dict[str, Any]], picture: Path) -> None:
    """The right blade's accelerance.

    Without damper, with every contact point stuck, with friction.
    """
    linear = next(group for name, group in arrays.items() if name.startswith("linear"))
    fig, ax = plt.subplots(figsize=(9.0, 4.6), layout="constrained")
    ax.semilogy(
        linear["frequency"],
        height(linear["accelerance_free_right"]),
        "--",
        color="#777777",
        label="no damper",
    )
    stuck = height(linear["accelerance_stuck_right"])
    ax.semilogy(linear["frequency"], stuck, "-", color="black", lw=1.2, label="damper stuck")
    for ratio, color in CURVES.items():
        curve = next(
            group for name, group in arrays.items() if name.endswith(f"F_C per F_E {ratio:g}")
        )
        f, H = curve["frequency"], height(curve["accelerance_right"])
        ax.semilogy(f, H, color=color, lw=1.8, label=f"friction, $F_C/F_E$ = {ratio}")
        k = int(np.argmax(np.where(f < 412.0, H, 0.0)))
        ax.annotate(
            f"{H[k]:.0f}",
            (f[k], H[k]),
            (-5, 1),
            textcoords="offset points",
            color=color,
            ha="right",
            weight="bold",
        )
    k = int(np.argmax(np.where(linear["frequency"] < 420.0, stuck, 0.0)))
    ax.annotate(
        f"{stuck[k]:.0f}",
        (linear["frequency"][k], stuck[k]),
        (0, 4),
        textcoords="offset points",
        ha="center",
        weight="bold",
    )
    ax.set(
        xlabel="frequency, Hz",
        ylabel="accelerance of the driven blade, (m/s²)/N",
        xlim=(280.0, 470.0),
        ylim=(2.0, 600.0),
    )
    ax.set_title("In-phase resonance of two blades, damped by friction on an asymmetric damper")
    ax.grid(True, which="major", color="#dddddd", lw=0.6)
    ax.legend(loc="upper center", bbox_to_anchor=(0.42, 1.0), fontsize=9)
    fig.savefig(picture, dpi=110)
    plt.close(fig)


def main(picture: Path = PICTURE) -> None:
    """Run the scene and draw."""
    with tempfile.TemporaryDirectory() as folder:
        upd.run("asymmetric-response", overrides=CHANGES, out=Path(folder) / "run", report=False)
        draw(read_netcdf(Path(folder) / "run" / "result.nc"), picture)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
