"""Bladed disks: modes by nodal diameter, rotation, damped response to an engine order."""
