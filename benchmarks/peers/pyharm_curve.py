"""The blade-damper-blade curve by pyHarm: problem as JSON on stdin, curve as JSON on stdout.

Run by bench_pyharm_response.py with the interpreter that has pyHarm, so nothing of upd is imported.
pyHarm's friction elements are a slider under constant normal load and one for three directions; the
planar contact whose normal load varies and vanishes is an element of one's own here.
"""

from __future__ import annotations

import json
import logging
import sys
import time
from importlib import metadata
from typing import Any

import numpy as np
from numba import njit
from pyHarm.Elements.NodeToNodeElements.NodeToNodeElement import NodeToNodeElement
from pyHarm.Maestro import Maestro

#: characteristic length and frequency: displacements over m, angular frequency over rad/s
LENGTH, OMEGA = 1e-3, 1e3
#: arc length between two points in those units: about 300 points on the curve
STEP = 0.008
ROUNDS = 3


@njit(cache=True)
def contact_force(u, ft, tf, k_n, k_t, mu):
    """Coefficients of (T, N) and their derivatives by those of the displacements (tangent, normal).

    Shapes: u (nhc, 2), ft (nhc, nt), tf (nt, nhc); the march repeats until the traction does.
    """
    nhc, nt = ft.shape
    w = ft.T @ u
    N = np.maximum(k_n * w[:, 1], 0.0)
    dN = np.zeros((nt, nhc))
    T, by_t, by_n = np.zeros(nt), np.zeros((nt, nhc)), np.zeros((nt, nhc))
    for j in range(nt):
        if N[j] > 0.0:
            dN[j] = k_n * ft[:, j]
    for _ in range(12):
        last = T[nt - 1]
        for j in range(nt):
            i = j - 1 if j > 0 else nt - 1
            trial = T[i] + k_t * (w[j, 0] - w[i, 0])
            if abs(trial) < mu * N[j]:
                T[j] = trial
                by_t[j] = by_t[i] + k_t * (ft[:, j] - ft[:, i])
                by_n[j] = by_n[i]
            else:
                T[j] = np.sign(trial) * mu * N[j]
                by_t[j] = 0.0
                by_n[j] = np.sign(trial) * mu * dN[j]
        if abs(T[nt - 1] - last) <= 1e-10:
            break
    force = np.empty((nhc, 2))
    force[:, 0], force[:, 1] = tf.T @ T, tf.T @ N
    jacobian = np.zeros((nhc, 2, nhc, 2))
    jacobian[:, 0, :, 0], jacobian[:, 0, :, 1] = tf.T @ by_t, tf.T @ by_n
    jacobian[:, 1, :, 1] = tf.T @ dN
    return force, jacobian


class WedgeContact(NodeToNodeElement):
    """Normal penalty with lift-off and a Coulomb slider below its varying load, in one plane."""

    factory_keyword = "wedge_contact"

    def __post_init__(self):
        """Stiffnesses as given; pyHarm scales them later."""
        self.k_n, self.k_t = self.data["k_n"], self.data["k_t"]

    def __flag_update__(self):
        """A nonlinear element in the time domain."""
        self.flag_nonlinear = self.flag_AFT = True

    def adim(self, lc, wc):
        """Stiffnesses by the characteristic length."""
        self.k_n, self.k_t, self.flag_adim = self.k_n * lc, self.k_t * lc, True

    def generateIndices(self, expl_dofs):
        """Map (2 nhc, dofs) onto tangential and normal displacements, harmonic by harmonic."""
        super().generateIndices(expl_dofs)
        nhc = len(self.D["ft"])
        self.B = np.kron(np.eye(nhc), self.data["frame"]) @ (self.Pslave - self.Pmaster)

    def evaluate(self, xg):
        """Force and derivative in the plane of the contact."""
        u = (self.B @ xg[self.indices]).reshape(-1, 2)
        return contact_force(u, self.D["ft"], self.D["tf"], self.k_n, self.k_t, self.data["mu"])

    def evalResidual(self, xg, om):
        """Contribution to the residual."""
        return self.B.T @ self.evaluate(xg)[0].ravel()

    def evalJacobian(self, xg, om):
        """Contribution to both Jacobians."""
        jacobian = self.evaluate(xg)[1].reshape(len(self.B), -1)
        return self.B.T @ jacobian @ self.B, np.zeros(len(self.indices))


def curve(p: dict[str, Any]) -> tuple[Any, Any]:
    """Frequencies in Hz and amplitudes of the first harmonic of the output."""
    M, C, K = (np.array(p[k]) for k in "MCK")
    normal, tangent = np.array(p["normal"]), np.array(p["tangent"])
    connectors = {}
    for k, slave in enumerate((0, 1)):
        rows = slice(2 * slave, 2 * slave + 2)
        connectors[f"contact{k}"] = {
            "type": "wedge_contact",
            "connect": [("rig", [slave]), ("rig", [2])],
            "dirs": [0, 1],
            "frame": np.array([tangent[k, rows], normal[k, rows]]),
            **{key: p[key] for key in ("k_n", "k_t", "mu")},
        }
    for harmonic, forces in ((0, p["static"]), (1, p["sine"])):
        for dof in np.flatnonzero(forces):
            connectors[f"force{harmonic}{dof}"] = {
                "type": "GOForcing",
                "connect": {"rig": [int(dof) // 2]},
                "dirs": [int(dof) % 2],
                "dto": 0,
                "ho": harmonic,
                "phi": np.pi / 2,
                "amp": float(forces[dof]),
            }
    low, high = (2 * np.pi * f for f in p["sweep"])
    model = Maestro(
        {
            "system": {
                "type": "Base",
                "nh": p["harmonics"],
                "nti": p["samples"],
                "adim": {"status": True, "lc": LENGTH, "wc": OMEGA},
            },
            "substructures": {"rig": {"matrix": {"M": M, "C": C, "K": K}, "ndofs": 2}},
            "connectors": connectors,
            "plugin": [WedgeContact],
            "analysis": {
                "frf": {
                    "study": "frf",
                    "puls_inf": low,
                    "puls_sup": high,
                    "ds0": STEP,
                    "ds_max": STEP,
                    "verbose": False,
                }
            },
        }
    )
    model.operate(np.ravel(p["start"]) / LENGTH)
    solved = [s.x for s in model.nls["frf"].SolList if s.flag_accepted]
    x = np.array(solved)[:, :-1].reshape(len(solved), -1, 6)[:, :, p["output"]] * LENGTH
    return np.array(solved)[:, -1] * OMEGA / (2 * np.pi), np.hypot(x[:, 1], x[:, 2])


def main() -> None:
    """The shortest of several runs after one that compiles."""
    logging.disable(logging.CRITICAL)
    problem = json.load(sys.stdin)
    version = f"pyHarm {metadata.version('pyHarm-os')}"
    seconds = []
    for _ in range(ROUNDS + 1):
        begin = time.process_time()
        frequency, amplitude = curve(problem)
        seconds.append(time.process_time() - begin)
    out = {"frequency": frequency.tolist(), "amplitude": amplitude.tolist()}
    print(json.dumps({**out, "seconds": min(seconds[1:]), "version": version}))


if __name__ == "__main__":
    main()
