"""
Bladed disk: from a sector to the damped travelling wave
========================================================

One sector of a disk with 24 blades gives the modes of all nodal diameters, the speeds at which
engine orders meet them, and the response there with a wedge damper in every gap. The mesh is coarse
here; the ready scene has 54 000 unknowns a sector and takes a minute.
"""

import upd

coarse = [
    "geometry.disk_layers=4",
    "geometry.shank_layers=2",
    "geometry.platform_layers=1",
    "geometry.blade_layers=10",
    "geometry.blade_columns=1",
    "geometry.overhang_columns=2",
    "geometry.axial=3",
]
result = upd.run("bladed-disk", overrides=coarse)
print(result)

# %%
result.plot("Campbell diagram")

# %%
result.plot("Interference diagram")

# %%
result.plot("Response to an engine order")

# %%
# The peak over F_C/F_E. Below the best one the wedges lift off, above it they stick.

result.plot("Performance curve")
