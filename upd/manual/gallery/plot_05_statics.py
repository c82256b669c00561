"""
Does the damper jam, lift off or tilt?
======================================

Before any dynamics: the damper as a rigid body between two faces, in closed form.
"""

import upd

design = upd.design("symmetric-response")
print(design.table())

# %%
# The same over the angles of the faces and over friction; the star is this damper:
design.plot()
