"""Parametric all-hex meshes made with gmsh."""
