"""
The damper with the lowest worst peak
=====================================

F_C is chosen so that the worst peak over a range of excitation forces is lowest.
"""

from pathlib import Path

import upd

scene = Path(upd.__file__).parent / "scenes" / "examples" / "damped_response.toml"
best = upd.design(
    scene,
    minimise="peak",
    over="damper.centrifugal=20:200",
    for_="excitation.force=0.5:2",
)
print(best.table())

# %%
# Left: the worst peak over F_C. Right: every peak over F_C/F_E.
best.plot()
