"""Parametric all-hex meshes made with gmsh: one recipe per module, shared blocks in `blocks`."""
