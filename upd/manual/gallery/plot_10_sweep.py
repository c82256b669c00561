"""
A sweep
=======

Any parameters over a grid; called again with the same folder, only what is missing runs.
"""

import upd

found = upd.sweep(
    "hertz",
    ["contact.friction=0.2,0.4,0.6"],
    overrides=["geometry.divisions=12", 'loads.normal=["200 N"]'],
    out="runs/sweep",
    workers=0,
)
print(found)

# %%
found.plot()
