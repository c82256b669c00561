"""Makes the synthetic measurements beside it: computed curves with noise, written as CSV.

./run.sh python upd/scenes/examples/measured/make.py
"""

from pathlib import Path

import numpy as np

import upd

HERE = Path(__file__).parent
DAMPING, NOISE, POINTS = "0.4 %", 0.02, 1500
SAID = "# synthetic: computed by upd with damping {} and {:g} % noise, not measured\n"


def main() -> None:
    """One run of the example with other damping; the free curve complex, one with friction not."""
    run = upd.run(
        HERE.parent / "damped_response.toml",
        overrides={
            "excitation.damping": DAMPING,
            "excitation.points": POINTS,
            "excitation.centrifugal_to_force": [400.0],
            "left_out.solve": "no",
            "accuracy": "unknown",
        },
    )
    errors = np.random.default_rng(0)
    linear, damped = run.arrays["linear own"], run.arrays["friction own, F_C/F_E 400"]
    f, H = linear["frequency"][1], linear["accelerance_free_right"][1] @ [1.0, 1j]
    on = (f > 310.0) & (f < 390.0)
    noise = errors.standard_normal((2, on.sum())) * NOISE
    H = H[on] + np.abs(H[on]) * (noise[0] + 1j * noise[1])
    write("free_right.csv", "real", "imaginary", columns=(f[on], H.real, H.imag))
    f, part = damped["frequency"][1], damped["accelerance_left"][1]
    size = np.hypot(*part.T) * (1.0 + NOISE * errors.standard_normal(len(f)))
    # a frequency a step: the path has more where it bends
    _, at = np.unique(f.round(1), return_index=True)
    write("damped_left.csv", "magnitude", columns=(f[at][::2], size[at][::2]))


def write(name: str, *parts: str, columns: tuple[np.ndarray, ...]) -> None:
    """One file; digits that noise leaves."""
    heads = ["frequency [Hz]", *(f"accelerance {part} [(m/s2)/N]" for part in parts)]
    lines = [
        f"{f:.3f}," + ",".join(f"{v:.5g}" for v in row) for f, *row in zip(*columns, strict=True)
    ]
    text = SAID.format(DAMPING, 100.0 * NOISE) + ",".join(heads) + "\n" + "\n".join(lines)
    (HERE / name).write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
