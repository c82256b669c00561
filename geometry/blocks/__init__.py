"""Building blocks of the recipes: a gmsh session, transfinite hexahedra in it, their lattices.

What a recipe of one's own needs is re-exported here; gmsh itself is loaded by the first `session`.
"""

from __future__ import annotations

from geometry.blocks.gmsh_session import (
    DEBIAN_PACKAGES,
    Blocks,
    count_for,
    graded,
    import_gmsh,
    ratio_for,
    require,
    session,
)
from geometry.blocks.hexahedron import REFERENCE, Grid, flipped, mirrored
from geometry.blocks.mesh_file import read_msh
from upd.mesh.fields import (
    DamperSizes,
    Size,
    choice,
    field_faults,
    in_degrees,
    in_mm,
    ratio,
    whole,
)

__all__ = [
    "DEBIAN_PACKAGES",
    "REFERENCE",
    "Blocks",
    "DamperSizes",
    "Grid",
    "Size",
    "choice",
    "count_for",
    "field_faults",
    "flipped",
    "graded",
    "import_gmsh",
    "in_degrees",
    "in_mm",
    "mirrored",
    "ratio",
    "ratio_for",
    "read_msh",
    "require",
    "session",
    "whole",
]
