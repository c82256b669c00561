"""
A sphere on a block: Hertz and Mindlin
======================================

A half-sphere is pressed on a block and sheared. Every number stands beside its closed form.
"""

import upd

result = upd.run("hertz", overrides=["geometry.divisions=20", 'loads.normal=["200 N"]'])
print(result)

# %%
# Pressure and contact states, and the loop of force over displacement:
result.plot("pressure", case="F=200 N")
