"""The mesh of one body and all that is asked of it.

Recipes that make it, checks, quality, files for other programs.
"""

from __future__ import annotations

from upd.mesh.hexmesh import FACE_SIZE, FloatArray, IntArray, Mesh

__all__ = ["FACE_SIZE", "FloatArray", "IntArray", "Mesh"]
