"""
A measured curve beside the computed one
========================================

The difference of the peaks, the frequency response assurance criterion, and damping fitted to the
whole curve.
"""

from pathlib import Path

import upd

scene = Path(upd.__file__).parent / "scenes" / "examples" / "measured_response.toml"
result = upd.run(scene)
print(result)

# %%
result.plot("response")
