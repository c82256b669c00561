"""Drawings of the ready recipes: sections through their meshes, and where each dimension lies.

A module per recipe, with two functions: ``coarse(params)``, the same geometry with few elements,
and ``views(params)``, what `upd.plot.drawing` draws. The points of a dimension are corners of the
layouts that the meshes are made from.
"""
