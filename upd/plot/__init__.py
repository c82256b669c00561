"""A figure is described once, as a Chart of arrays, and drawn by matplotlib or plotly; a table
once, as an AnswerTable, for terminal, page and notebook.

Pictures of modes and surfaces beside it.
"""
