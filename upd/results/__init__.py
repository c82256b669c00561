"""What a run leaves behind: cases, numbers with their errors, checks, and arrays in one file."""

from upd.results.case import NO_CASE as NO_CASE
from upd.results.case import Case as Case
from upd.results.case import shared_label as shared_label
from upd.results.check import Check as Check
from upd.results.netcdf import Arrays as Arrays
from upd.results.netcdf import Group as Group
from upd.results.netcdf import Variable as Variable
from upd.results.netcdf import read_netcdf as read_netcdf
from upd.results.netcdf import variable as variable
from upd.results.netcdf import write_netcdf as write_netcdf
from upd.results.number import ErrorPart as ErrorPart
from upd.results.number import Estimates as Estimates
from upd.results.number import InputPart as InputPart
from upd.results.number import Result as Result
from upd.results.number import with_parts as with_parts
