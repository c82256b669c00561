"""Which damper: what is known of one before any dynamics, and which is best.

`design` is what a user calls; `damper_statics` the numbers of the statics, `statics_charts` their
pictures. `lowest_worst` finds the F_C whose worst peak is lowest from peaks followed over F_C/F_E,
of a rig or of any balance.
"""

from upd.sizing.answer import BestDamper, DamperDesign, design
from upd.sizing.choice import ChosenDamper
from upd.sizing.least_worst import LowestWorst, lowest_worst
from upd.sizing.ratio_curves import PeaksOverRatio
from upd.sizing.statics import DamperStatics, damper_statics
from upd.sizing.worst_peak import WorstPeak

__all__ = [
    "BestDamper",
    "ChosenDamper",
    "DamperDesign",
    "DamperStatics",
    "LowestWorst",
    "PeaksOverRatio",
    "WorstPeak",
    "damper_statics",
    "design",
    "lowest_worst",
]
