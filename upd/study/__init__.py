"""Studies of what accuracy costs: convergence rates, ladders of runs that resume, the mesh for a wanted accuracy."""
