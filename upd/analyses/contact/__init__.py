"""What the analyses of a contact share: bodies condensed on their contact nodes, cycles, displacements inside them, checks."""
