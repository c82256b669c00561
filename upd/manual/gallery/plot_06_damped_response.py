"""
A damped response
=================

Two blades with a wedge between their platforms, driven near resonance: free, stuck, and with
friction.
"""

from pathlib import Path

import upd

scene = Path(upd.__file__).parent / "scenes" / "examples" / "damped_response.toml"
result = upd.run(scene)
print(result)

# %%
# The contact slips near the peak and takes energy out:
result.plot("response")
