"""Everything that runs many times.

Sweeps over grids of parameters, studies of what accuracy costs. One engine runs their points.
"""
