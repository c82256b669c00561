"""
A wedge of your own
===================

The ready recipes take any dimensions: here a wedge under 100 N. ``upd describe wedge_platform``
lists them with their bounds.
"""

import upd

scene = {
    "name": "wedge",
    "title": "A wedge on its platform",
    "want": ["normal", "stiffness"],
    "geometry": {"recipe": "wedge_platform", "divisions": 8},
    "materials": {"damper": {"E": "200 GPa", "nu": 0.3}, "platform": {"E": "200 GPa", "nu": 0.3}},
    "loads": {"normal": ["100 N"]},
    "contact": {"tilt": "free"},
}
result = upd.run(scene)
print(result)

# %%
# The pressure is highest at the edges, where it has no limit: use the stiffness.
result.plot("pressure")
