"""Which damper: what can be told of one before any dynamics.

`design` is what a user calls; `damper_statics` the numbers, `statics_charts` their pictures.
"""

from upd.sizing.answer import DamperDesign, design
from upd.sizing.statics import DamperStatics, damper_statics

__all__ = ["DamperDesign", "DamperStatics", "damper_statics", "design"]
