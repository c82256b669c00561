"""The seated state in result.nc, written and read back: what a forced response starts from.

Group "faces": the nodes of both faces. Groups "state NAME": forces, slip, gap and motion after a
way of loading, in the layout of `Interface`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.seated.interface import Interface
from upd.contact import CoupledHistory
from upd.errors import InputError
from upd.results import ArrayGroup, Case, read_netcdf, variable

Array = NDArray[np.float64]
#: what the groups hold, their attribute ``content``
FACES, STATE = "seated faces", "seated state"
_FACES, _STATE = "faces", "state"
#: relative distance up to which nodes are the same
_SAME = 1e-9
_DIMS: dict[str, tuple[str, str]] = {
    "force": ("contact_node component", "N"),
    "slip": ("contact_node tangent", "mm"),
    "gap": ("contact_node", "mm"),
    "motion": ("motion", "mm"),
    "step": ("contact_node tangent", "mm"),
    "load": ("motion", "N"),
}


@dataclass(frozen=True)
class SeatedState:
    """State of both faces after a way of loading.

    Attributes
    ----------
    position : (n, 3) ndarray
        Nodes, mm, those of the left face first.
    face : (n,) array of int
        0 left, 1 right.
    frame : (2, 3, 3) ndarray
        Of each face, unit rows: normal into the blade, along the damper, up the slope.
    gap : (n,) ndarray
        mm, before any load.
    copies : int
        Models that make the whole: 2 of a half.
    friction : float
        Coefficient.
    centrifugal : float
        F_C, N.
    history
        To go on from, with `Interface.seat`.
    """

    position: Array
    face: NDArray[np.int64]
    frame: Array
    gap: Array
    copies: int
    friction: float
    centrifugal: float
    history: CoupledHistory

    def of(self, interface: Interface) -> CoupledHistory:
        """The history, for the contact it belongs to.

        Raises
        ------
        InputError
            When the contact has other nodes.
        """
        size = float(np.ptp(interface.position, axis=0).max())
        if (
            interface.copies != self.copies
            or interface.position.shape != self.position.shape
            or np.abs(interface.position - self.position).max() > _SAME * size
        ):
            raise InputError(
                f"the seated state has {len(self.position)} nodes of {_part(self.copies)}, this "
                f"contact {interface.n} of {_part(interface.copies)}, or they lie elsewhere: run "
                "the seated damper with the geometry, mesh and symmetry of this scene"
            )
        return self.history


def _part(copies: int) -> str:
    return "a half model" if copies > 1 else "the full model"


def faces_group(of: Interface, gap: Array) -> ArrayGroup:
    """The nodes of both faces."""
    node = "contact_node"
    return ArrayGroup(
        {
            "position": variable("contact_node axis", of.position, "mm"),
            "face": variable(node, of.face, flag_meanings="left right"),
            "area": variable(node, of.area, "mm2"),
            "gap": variable(node, gap, "mm", "gap before any load"),
            "frame": variable(
                "side component axis",
                of.frame,
                "",
                "normal into the blade, along the damper, up the slope",
            ),
            "copies": variable("", of.copies, "", "models that make the whole"),
        },
        content=FACES,
    )


def state_group(
    history: CoupledHistory, state: NDArray[np.int64], case: Case, *, centrifugal: float, mu: float
) -> ArrayGroup:
    """The state after a way of loading."""
    variables: dict[str, Any] = {
        name: variable(dims, getattr(history, name), unit) for name, (dims, unit) in _DIMS.items()
    }
    variables["state"] = variable("contact_node", state, flag_meanings="open stick slip")
    variables["centrifugal"] = variable("", centrifugal, "N")
    variables["friction"] = variable("", mu, "1")
    return ArrayGroup(variables, content=STATE, case=case)


def state_name(name: str) -> str:
    """The group of a way of loading."""
    return f"{_STATE} {name}"


def read_state(folder: str | Path, name: str = "raised") -> SeatedState:
    """The state that a finished run of a seated damper left.

    Parameters
    ----------
    folder
        Run folder.
    name
        Way of loading: "raised", "lowered", "raised again", "over-pressed", "vibrated in".

    Returns
    -------
    SeatedState

    Raises
    ------
    InputError
        When the folder has no such state.

    Examples
    --------
    >>> from upd.analyses.seated.state import read_state
    >>> read_state("runs/symmetric-seated").history.force.shape  # doctest: +SKIP
    (468, 3)
    """
    path = Path(folder) / "result.nc"
    try:
        groups = read_netcdf(path)
    except OSError as error:
        raise InputError(
            f"no seated state in {path} ({error}): give the folder of a finished run of a seated "
            "damper"
        ) from None
    states = [key.removeprefix(f"{_STATE} ") for key in groups if key.startswith(f"{_STATE} ")]
    if _FACES not in groups or name not in states:
        known = f"; it has {', '.join(states)}" if states else ""
        raise InputError(
            f"{path} holds no seated state {name!r}{known}: give the folder of a finished run of a "
            "seated damper"
        )
    faces, state = groups[_FACES], groups[state_name(name)]
    return SeatedState(
        _data(faces, "position"),
        np.asarray(_data(faces, "face"), np.int64),
        _data(faces, "frame"),
        _data(faces, "gap"),
        int(_data(faces, "copies")),
        float(_data(state, "friction")),
        float(_data(state, "centrifugal")),
        CoupledHistory(**{one: _data(state, one) for one in _DIMS}),
    )


def _data(group: Mapping[str, Any], name: str) -> Array:
    return np.asarray(group[name], np.float64)
