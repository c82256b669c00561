"""What the analyses of a contact share.

Bodies condensed on their contact nodes, cycles, displacements inside them, checks.
"""
