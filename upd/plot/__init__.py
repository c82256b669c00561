"""A figure is described once, as a Chart of arrays, and drawn by matplotlib or plotly.

Pictures of modes and surfaces beside it.
"""
