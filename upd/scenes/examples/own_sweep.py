"""Contact stiffness of your own wedge over friction and length of the contact.

    ./run.sh python upd/scenes/examples/own_sweep.py [FOLDER]

The same from the shell: upd sweep upd/scenes/examples/own_wedge.toml --vary ... --follow ...
"""

import sys
from pathlib import Path

import upd


def main(folder: Path) -> None:
    """Run six points; a second call finds them done."""
    result = upd.sweep(
        Path(__file__).parent / "own_wedge.toml",
        ["contact.friction=0.2,0.4", "geometry.patch_length=4 mm:8 mm:3"],
        overrides={
            "want": ["normal", "stiffness"],
            "geometry.divisions": 4,
            "geometry.divisions_long": 10,
            "left_out.solve": "no",
        },
        out=folder,
        follow=["K_N_tangent_raw", "K_Ty_initial_raw", "F_N"],
    )
    stiffness = result.column("K_N_tangent_raw").values
    print(f"{len(result.outcomes)} points, {len(result.failed)} failed: {folder}/report.html")
    print(f"K_N from {min(stiffness):.3e} to {max(stiffness):.3e} N/mm")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/own_sweep"))
