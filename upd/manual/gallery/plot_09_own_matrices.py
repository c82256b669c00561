"""
K and M of another program, with a friction joint
=================================================

Matrices of any finite-element program, a joint with friction, a harmonic force.
"""

import runpy
from pathlib import Path

import upd

example = Path(upd.__file__).parent / "scenes" / "examples" / "own_matrices.py"
print(example.read_text())

# %%
# What it prints:
names = runpy.run_path(str(example), run_name="__main__")
