"""An elastic damper between two elastic blades, seated by F_C with friction.

Coupled contact on every matching node of both faces: forces, stick and slip, stiffness, hysteresis.
"""
