"""What a run leaves behind: cases, numbers with their errors, checks, and arrays in one file."""

from upd.results.case import NO_CASE, Case, shared_label
from upd.results.check import Check, left_out_check, worst_check, worst_checks
from upd.results.netcdf import ArrayGroup, read_netcdf, write_netcdf
from upd.results.number import (
    ErrorPart,
    Estimates,
    InputPart,
    InputParts,
    Result,
    Row,
    read_input_part,
    read_part,
    with_estimates,
    with_inputs,
    with_parts,
    withheld,
)
from upd.results.status import (
    FAILED,
    OK,
    WARNED,
    outcome_of,
    status_of,
    warned,
    warnings_of,
    with_fault,
)

__all__ = [
    "FAILED",
    "NO_CASE",
    "OK",
    "WARNED",
    "ArrayGroup",
    "Case",
    "Check",
    "ErrorPart",
    "Estimates",
    "InputPart",
    "InputParts",
    "Result",
    "Row",
    "left_out_check",
    "outcome_of",
    "read_input_part",
    "read_netcdf",
    "read_part",
    "shared_label",
    "status_of",
    "warned",
    "warnings_of",
    "with_estimates",
    "with_fault",
    "with_inputs",
    "with_parts",
    "withheld",
    "worst_check",
    "worst_checks",
    "write_netcdf",
]
