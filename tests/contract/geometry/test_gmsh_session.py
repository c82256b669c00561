"""A session of gmsh leaves the process as it was."""

from __future__ import annotations

import os
import signal
import threading

import pytest

from geometry.blocks.gmsh_session import session


@pytest.mark.skipif(not hasattr(signal, "SIGPIPE"), reason="this system has no SIGPIPE")
@pytest.mark.parametrize("in_thread", [False, True])
def test_a_closed_pipe_stays_an_error_after_gmsh(in_thread: bool) -> None:
    """Not the silent end of the process. Left to gmsh, this test ends the tests."""

    def mesh() -> None:
        with session("empty"):
            pass

    if in_thread:
        thread = threading.Thread(target=mesh)
        thread.start()
        thread.join()
    else:
        mesh()
    reader, writer = os.pipe()
    os.close(reader)
    try:
        with pytest.raises(BrokenPipeError):
            os.write(writer, b"x")
    finally:
        os.close(writer)
