"""
Convergence of a damper's contact stiffness
===========================================

A flat punch has no closed form on finite bodies, and the pressure at its edges grows with every
mesh. Its stiffness converges, but slowly: the study fits the order and the limit.
"""

import upd

study = upd.study(
    "symmetric",
    "mesh",
    levels=[4, 6, 8, 12],
    overrides=['want=["normal","stiffness"]'],
    out="runs/study-symmetric",
    workers=0,
)
print(study)
print(study.table())

# %%
study.plot()
