"""K and M of another finite-element program with a friction joint: the damped peak.

Put your own files, nodes and numbers in; N, mm and t give Hz:
    ./run.sh python upd/scenes/examples/other_program.py [FIGURE.png]
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from upd.own_matrices import Joint, forced_response

#: two cantilevers side by side: nodes 1 to 6 and 101 to 106, the last at the tip
FILES = Path(__file__).parent / "blades"
#: the damper rubs between the blades at two thirds of their height
RUBBING = {(4, "UX"): 1.0, (104, "UX"): -1.0}
FREQUENCIES = np.linspace(320.0, 430.0, 45)

answer = forced_response(
    FILES / "blades.K.mtx",
    FILES / "blades.M.mtx",
    dofs=FILES / "blades.mapping",
    zeta=0.005,
    joints=[Joint(closing={}, sliding=[RUBBING], k_n=0.0, k_t=600.0, mu=0.4, preload=20.0)],
    force={(3, "UX"): 4.0},
    watch={"tip": (6, "UX")},
    frequencies=FREQUENCIES,
    harmonics=(1, 3),
)
fine = np.linspace(320.0, 430.0, 2001)
free = answer.free("tip", fine).max()
frequency, peak = answer.peak("tip")
print(f"free peak {1e3 * free:.0f} um")
print(f"damped peak {1e3 * peak:.0f} um at {frequency:.2f} Hz ({answer.status})")
if sys.argv[1:]:
    plt.semilogy(fine, answer.free("tip", fine), answer.frequency, answer.amplitude("tip"))
    plt.gca().set(xlabel="frequency, Hz", ylabel="amplitude of the tip, mm")
    plt.savefig(sys.argv[1])
