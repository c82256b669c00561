"""
From measured frequencies to a model
====================================

Contact stiffnesses are fitted to two stuck frequencies that were measured. Heights with friction
are then predictions of the fitted model. The answer prints how well each input is known, and what
to measure next.
"""

import upd

found = upd.fit(
    "asymmetric-response",
    "stuck_in_phase=377 Hz,stuck_out_of_phase=440.5 Hz",
    ["stiffness.thesis.right.K_N+stiffness.thesis.right.K_T", "stiffness.thesis.left.K_T"],
    overrides=["geometry.refine=0.5", "contact.rows=5"],
    starts=2,
)
print(found.table())

# %%
# What each input does to the targets, to first order:
found.plot()
