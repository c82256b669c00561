"""
A public benchmark: modes, response, stability
==============================================

Two blades of two masses each and a damper of two coordinates between them, with faces at 30 degrees
that slip and open (N. Balaji, public scripts `nonuniq`). The numbers of an independent program
stand beside ours.
"""

import matplotlib.pyplot as plt
import numpy as np

from upd.hbm import System, contacts, frequency_response, nonlinear_mode, stability

M, C = np.diag([1.0, 1, 1, 1, 0.1, 0.1]), np.diag([20.0] * 4 + [0, 0])
K = np.diag([3e5] * 4 + [0, 0])
for i, j, k in ((0, 1, 3e5), (2, 3, 3e5), (0, 2, 7e5), (1, 3, 7e5), (4, 5, 3e5)):
    K[np.ix_([i, j], [i, j])] += k * np.array([[1, -1], [-1, 1]])
c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
faces = contacts(
    [[s, -c, 0, 0, -s, c], [0, 0, -s, -c, s, c]],
    [[[-c, -s, 0, 0, c, s], [0, 0, -c, s, c, -s]]],
    k_n=3e5,
    k_t=3e5,
    mu=0.5,
)
static, force, out = [0, 0, 0, 0, 0, 120.0], -1j * np.array([0, -20, 5, 0, 0, 0]), np.eye(6)[3]

# %%
# The forced response with 15 harmonics, beside the printed peak and points; where the motion is
# unstable it is dashed.
printed = {150: 2.7919e-5, 160: 2.0006e-4, 162.96: 2.2733e-4, 165: 1.5215e-4, 200: 3.2477e-5}
system = System((M, C, K), faces, static_force=static, harmonics=range(16), samples=512)
hertz = np.linspace(145.0, 235.0, 91)
answer = frequency_response(system, harmonic_force=force, frequencies=hertz)
amplitude = answer.amplitude(out)
label = np.array(stability(answer).label)
steady = (label == "stable") | (label == "undecided")
fig, ax = plt.subplots()
ax.semilogy(answer.frequency, np.where(steady, amplitude, np.nan), label="harmonic balance")
ax.semilogy(answer.frequency, np.where(steady, np.nan, amplitude), "--", c="C0", label="unstable")
ax.semilogy(printed.keys(), printed.values(), "o", c="k", mfc="none", label="printed")
ax.set(xlabel="frequency, Hz", ylabel="amplitude of the second blade, m")
ax.legend()
fig.tight_layout()
for f, known in printed.items():
    near = amplitude[np.abs(answer.frequency - f).argmin()] if f != 162.96 else amplitude.max()
    print(f"{f:7.2f} Hz  {near:.4e} m, printed {known:.4e}, {100 * (near / known - 1):+.2f} %")

# %%
# The third mode over its amplitude, by nine harmonics, beside values by shooting: frequency and
# damping need no force and no sweep.
system = System((M, C, K), faces, static_force=static)
mode = nonlinear_mode(system, mode=3, amplitudes=np.geomspace(1e-6, 10**-3.4, 40))
shooting = {-4.0: (222.9916, 2.1716), -3.8: (212.9318, 4.6632), -3.6: (207.1169, 4.1153)}
fig, axes = plt.subplots(2, sharex=True)
shown = {"frequency, Hz": mode.frequency, "damping ratio, %": 100 * mode.damping}
for k, (name, values) in enumerate(shown.items()):
    axes[k].semilogx(mode.amplitude, values, label="nonlinear mode")
    points = [one[k] for one in shooting.values()]
    axes[k].semilogx([10**a for a in shooting], points, "o", c="k", mfc="none", label="shooting")
    axes[k].set_ylabel(name)
axes[1].set_xlabel("modal amplitude")
axes[0].legend()
zeta, at, f = mode.largest_damping
print(f"largest damping {100 * zeta:.2f} % at {f:.1f} Hz")

# %%
# From that one curve come the forced peak, and the preload whose peak is lowest for this force.
f, height = mode.peak(force, out)
factor, worst = mode.best_preload(force, out)
print(f"peak {height:.3e} m at {f:.1f} Hz; lowest {worst:.3e} m at {factor:.2f} times the preload")
