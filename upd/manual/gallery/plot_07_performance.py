"""
The performance curve
=====================

The highest peak over F_C/F_E: too light a damper does not take energy, too heavy a one sticks.
"""

from pathlib import Path

import upd

scene = Path(upd.__file__).parent / "scenes" / "examples" / "damped_response.toml"
more = ['want=["response", "performance"]', "performance.points=6", "performance.lowest=10"]
result = upd.run(scene, overrides=more)
print(result)

# %%
result.plot("performance")
