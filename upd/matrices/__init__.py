"""K and M of other programs.

Files (Matrix Market, Harwell-Boeing, npz), the map of their dofs, their forced response.
"""

from upd.matrices.files import COMPONENTS as COMPONENTS
from upd.matrices.files import DofMap as DofMap
from upd.matrices.files import Matrices as Matrices
from upd.matrices.files import check_sizes as check_sizes
from upd.matrices.files import checked as checked
from upd.matrices.files import read_dof_map as read_dof_map
from upd.matrices.files import read_matrices as read_matrices
from upd.matrices.files import read_matrix as read_matrix
from upd.matrices.files import write_dof_map as write_dof_map
from upd.matrices.files import write_matrices as write_matrices
from upd.matrices.files import write_matrix as write_matrix
