"""Forced response with friction contacts.

Multi-harmonic balance, continuation, time-march cross-check.

>>> import numpy as np
>>> from upd.hbm import System, contacts, frequency_response
>>> slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=0.5)  # Jenkins, to ground
>>> system = System((np.eye(1), 0.02 * np.eye(1), np.eye(1)), slider, harmonics=(1, 3))
>>> f = np.linspace(0.15, 0.3, 16)
>>> answer = frequency_response(system, harmonic_force=[0.3], frequencies=f)
>>> answer.status
'complete'
>>> bool(answer.amplitude([1.0]).max() < answer.stuck([1.0], np.linspace(0.15, 0.3, 151)).max())
True
"""

from upd.hbm.core.continuation import Path, follow
from upd.hbm.core.fourier import Harmonics, harmonics
from upd.hbm.core.newton import PathProblem, Settings, State
from upd.hbm.springs.damper import RigidDamper, contact_rows, rigid_damper
from upd.hbm.springs.nonlinear_mode import NonlinearMode, nonlinear_mode
from upd.hbm.springs.peak import Peak, climb
from upd.hbm.springs.points import Contacts, Law, contacts
from upd.hbm.springs.response import FrequencyResponse, System, frequency_response
from upd.hbm.springs.stability import Stability, stability
from upd.hbm.springs.time_integration import SteadyState, steady_state
from upd.hbm.springs.waves import (
    WaveInTime,
    all_sectors,
    nodal_diameters,
    travelling_wave_response,
    wave_in_time,
)

__all__ = [
    "Contacts",
    "FrequencyResponse",
    "Harmonics",
    "Law",
    "NonlinearMode",
    "Path",
    "PathProblem",
    "Peak",
    "RigidDamper",
    "Settings",
    "Stability",
    "State",
    "SteadyState",
    "System",
    "WaveInTime",
    "all_sectors",
    "climb",
    "contact_rows",
    "contacts",
    "follow",
    "frequency_response",
    "harmonics",
    "nodal_diameters",
    "nonlinear_mode",
    "rigid_damper",
    "stability",
    "steady_state",
    "travelling_wave_response",
    "wave_in_time",
]
