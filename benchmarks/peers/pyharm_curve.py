"""The blade-damper-blade curve by pyHarm: problem as JSON on stdin, curve as JSON on stdout.

Run by bench_pyharm_response.py with the interpreter that has pyHarm, so nothing of upd is imported.
With the argument "own" the contacts are an element of one's own, compiled and in the plane; with
"stock" they are pyHarm's Penalty3D (normal penalty with lift-off, slider in two directions below
its varying load), for which every node gets a third direction that nothing drives.
"""

from __future__ import annotations

import json
import logging
import sys
import time
from importlib import metadata
from typing import Any

import jax
import numpy as np
from numba import njit
from pyHarm.Elements.NodeToNodeElements.NodeToNodeElement import NodeToNodeElement
from pyHarm.Maestro import Maestro

#: characteristic length and frequency: displacements over m, angular frequency over rad/s
LENGTH, OMEGA = 1e-3, 1e3
#: arc length between two points in those units: about 300 points on the curve
STEP = 0.008
ROUNDS = 3
#: N
NO_PRELOAD = 1e-6
#: dofs in the plane, of nodes with three
PLANE = [0, 1, 3, 4, 6, 7]


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


def own_contacts(p: dict[str, Any]) -> dict[str, Any]:
    """Both contacts as elements of one's own, between a blade's node and the damper's."""
    return {
        f"contact{k}": {
            "type": "wedge_contact",
            "connect": [("rig", [k]), ("rig", [2])],
            "dirs": [0, 1],
            "frame": np.array([p["tangent"][k], p["normal"][k]])[:, 2 * k : 2 * k + 2],
            **{key: p[key] for key in ("k_n", "k_t", "mu")},
        }
        for k in (0, 1)
    }


def stock_contacts(p: dict[str, Any]) -> dict[str, Any]:
    """Both contacts as pyHarm's element; its friction needs a preload above zero, here none."""
    return {
        f"contact{k}": {
            "type": "Penalty3D",
            "connect": [("rig", [k]), ("rig", [2])],
            "coordinatesystem": f"face{k}",
            "dirs": [0, 1, 2],
            "g": 0.0,
            "N0": NO_PRELOAD,
            **{key: p[key] for key in ("k_n", "k_t", "mu")},
        }
        for k in (0, 1)
    }


def stock_frames(p: dict[str, Any]) -> dict[str, Any]:
    """Directions of both faces: opening, along the face, out of the plane."""
    return {
        f"face{k}": [
            [*(-np.array(p["normal"][k][2 * k : 2 * k + 2])), 0.0],
            [*p["tangent"][k][2 * k : 2 * k + 2], 0.0],
            [0.0, 0.0, 1.0],
        ]
        for k in (0, 1)
    }


def in_space(matrix: Any, out_of_plane: float) -> Any:
    """A matrix of planar nodes as one of nodes in space, with a diagonal out of the plane."""
    wide = out_of_plane * np.kron(np.eye(3), np.diag([0.0, 0.0, 1.0]))
    wide[np.ix_(PLANE, PLANE)] = matrix
    return wide


def curve(p: dict[str, Any], stock: bool) -> tuple[Any, Any]:
    """Frequencies in Hz and amplitudes of the first harmonic of the output."""
    matrices = {k: np.array(p[k]) for k in "MCK"}
    start = np.array(p["start"])
    output, per_node = p["output"], 2
    if stock:
        matrices = {k: in_space(A, A[0, 0]) for k, A in matrices.items()}
        planar, start = start, np.zeros((len(start), 9))
        start[:, PLANE] = planar
        # the slider's direction has no derivative where nothing has moved
        start[1, 2::3] = 1e-5 * LENGTH
        output, per_node = PLANE[output], 3
    connectors = stock_contacts(p) if stock else own_contacts(p)
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
            "substructures": {"rig": {"matrix": matrices, "ndofs": per_node}},
            "coordinates": stock_frames(p) if stock else {},
            "connectors": connectors,
            "plugin": [] if stock else [WedgeContact],
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
    model.operate(start.ravel() / LENGTH)
    solved = np.array([s.x for s in model.nls["frf"].SolList if s.flag_accepted])
    x = solved[:, :-1].reshape(len(solved), len(start), -1)[:, :, output] * LENGTH
    return solved[:, -1] * OMEGA / (2 * np.pi), np.hypot(x[:, 1], x[:, 2])


def main() -> None:
    """The shortest of several runs after one that compiles."""
    logging.disable(logging.CRITICAL)
    jax.config.update("jax_enable_x64", True)
    stock = sys.argv[1] == "stock"
    problem = json.load(sys.stdin)
    version = f"pyHarm {metadata.version('pyHarm-os')}"
    seconds = []
    for _ in range(ROUNDS + 1):
        begin = time.process_time()
        frequency, amplitude = curve(problem, stock)
        seconds.append(time.process_time() - begin)
    out = {"frequency": frequency.tolist(), "amplitude": amplitude.tolist()}
    print(json.dumps({**out, "seconds": min(seconds[1:]), "version": version}))


if __name__ == "__main__":
    main()
