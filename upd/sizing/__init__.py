"""Which damper: what is known of one before any dynamics, and which is best.

`design` is what a user calls; `damper_statics` the numbers of the statics. `lowest_worst` finds the
F_C whose worst peak is lowest from peaks of whole curves over F_C/F_E, of a rig or of any balance.
"""

from upd.sizing.choice import BestDamper
from upd.sizing.search import design
from upd.sizing.statics import DamperDesign, damper_statics
from upd.sizing.worst_peak import LowestWorst, WorstPeak, lowest_worst

__all__ = [
    "BestDamper",
    "DamperDesign",
    "LowestWorst",
    "WorstPeak",
    "damper_statics",
    "design",
    "lowest_worst",
]
