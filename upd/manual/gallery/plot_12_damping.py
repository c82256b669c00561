"""
Damping over amplitude
======================

How much damping, at which amplitude, at which frequency: nonlinear modes of the asymmetric damper.
In phase its faces slip, and the damping rises to ten per cent. Out of phase they open before they
slip, and the damping hardly rises.
"""

import upd

more = ['want=["nonlinear_modes"]', "accuracy=unknown", "left_out.solve=no"]
result = upd.run("asymmetric-response", overrides=more)
print(result)

# %%
result.plot("Damping ratio over the amplitude")
