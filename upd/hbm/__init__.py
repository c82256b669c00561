"""Forced response with friction contacts.

Multi-harmonic balance, continuation, time-march cross-check.

>>> import numpy as np
>>> from upd.hbm import contacts, frequency_response
>>> slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=0.5)  # Jenkins, to ground
>>> answer = frequency_response(
...     np.eye(1), 0.02 * np.eye(1), np.eye(1), slider,
...     harmonic_force=[0.3], frequencies=np.linspace(0.15, 0.3, 16), harmonics=(1, 3),
... )
>>> answer.status
'complete'
>>> bool(answer.amplitude([1.0]).max() < answer.stuck([1.0], np.linspace(0.15, 0.3, 151)).max())
True
"""

from typing import TYPE_CHECKING

from upd.lazy_names import load_on_use

if TYPE_CHECKING:
    from upd.hbm.core.continuation import Path as Path
    from upd.hbm.core.continuation import State as State
    from upd.hbm.core.continuation import follow as follow
    from upd.hbm.core.fourier import Harmonics as Harmonics
    from upd.hbm.core.fourier import harmonics as harmonics
    from upd.hbm.core.newton import Settings as Settings
    from upd.hbm.springs.damper import RigidDamper as RigidDamper
    from upd.hbm.springs.damper import contact_rows as contact_rows
    from upd.hbm.springs.damper import rigid_damper as rigid_damper
    from upd.hbm.springs.nonlinear_mode import NonlinearMode as NonlinearMode
    from upd.hbm.springs.nonlinear_mode import nonlinear_mode as nonlinear_mode
    from upd.hbm.springs.peak import Peak as Peak
    from upd.hbm.springs.peak import climb as climb
    from upd.hbm.springs.points import Contacts as Contacts
    from upd.hbm.springs.points import Law as Law
    from upd.hbm.springs.points import contacts as contacts
    from upd.hbm.springs.response import FrequencyResponse as FrequencyResponse
    from upd.hbm.springs.response import frequency_response as frequency_response
    from upd.hbm.springs.stability import Stability as Stability
    from upd.hbm.springs.stability import stability as stability
    from upd.hbm.springs.time_integration import SteadyState as SteadyState
    from upd.hbm.springs.time_integration import steady_state as steady_state
    from upd.hbm.springs.waves import WaveInTime as WaveInTime
    from upd.hbm.springs.waves import all_sectors as all_sectors
    from upd.hbm.springs.waves import nodal_diameters as nodal_diameters
    from upd.hbm.springs.waves import travelling_wave_response as travelling_wave_response
    from upd.hbm.springs.waves import wave_in_time as wave_in_time
else:
    __getattr__, __dir__, __all__ = load_on_use(
        __name__,
        {
            "core.continuation": "Path State follow",
            "core.fourier": "Harmonics harmonics",
            "core.newton": "Settings",
            "springs.damper": "RigidDamper contact_rows rigid_damper",
            "springs.nonlinear_mode": "NonlinearMode nonlinear_mode",
            "springs.peak": "Peak climb",
            "springs.points": "Contacts Law contacts",
            "springs.response": "FrequencyResponse frequency_response",
            "springs.stability": "Stability stability",
            "springs.time_integration": "SteadyState steady_state",
            "springs.waves": (
                "WaveInTime all_sectors nodal_diameters travelling_wave_response wave_in_time"
            ),
        },
    )
