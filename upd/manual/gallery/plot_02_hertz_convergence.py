"""
How fine must the mesh be?
==========================

A convergence study solves the same scene on a ladder of meshes. It prints the cheapest level within
an accuracy; the table has the numbers of every level with seconds and memory.
"""

import upd

study = upd.study(
    "hertz",
    "mesh",
    levels=[8, 12, 16, 24],
    overrides=['want=["normal"]'],
    out="runs/study-hertz",
    workers=0,
)
print(study)

print(study.table())

# %%
# Errors against their cost:
study.plot()
