"""What a run leaves behind: cases, numbers with their errors, checks, and arrays in one file."""

from upd.results.case import NO_CASE, Case, shared_label
from upd.results.check import Check
from upd.results.netcdf import Arrays, Group, Variable, read_netcdf, variable, write_netcdf
from upd.results.number import ErrorPart, Estimates, InputPart, Result, with_parts

__all__ = [
    "NO_CASE",
    "Arrays",
    "Case",
    "Check",
    "ErrorPart",
    "Estimates",
    "Group",
    "InputPart",
    "Result",
    "Variable",
    "read_netcdf",
    "shared_label",
    "variable",
    "with_parts",
    "write_netcdf",
]
