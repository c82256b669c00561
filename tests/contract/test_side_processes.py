"""Jobs on processes beside this one: what they find comes back in order, whatever dies."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from upd.errors import ConvergenceError
from upd.linalg.processes import MOST_BESIDE, SideProcesses


def doubled(number: int, seconds: float = 0.0) -> tuple[int, int]:
    """With the process that did it."""
    time.sleep(seconds)
    return 2 * number, os.getpid()


def noisy(number: int) -> int:
    sys.stdout.write("a line that is no answer\n")
    sys.stdout.flush()
    return number


def fails(number: int) -> None:
    raise ConvergenceError(f"step {number} has no answer")


def breaks(number: int) -> float:
    return number / 0


def dies(number: int, here: int) -> tuple[int, int]:
    """In every process but this one."""
    if os.getpid() != here:
        os.kill(os.getpid(), signal.SIGKILL)
    return doubled(number)


def waits(number: int, here: int) -> tuple[int, int]:
    """Long enough in this process that others take what follows; there until this one waits."""
    return doubled(number, 1.0 if os.getpid() == here else 0.2)


def unknown(number: int) -> Any:
    """What cannot be sent."""
    return lambda: number


def ready(beside: SideProcesses) -> SideProcesses:
    """Once another process has answered."""
    while {pid for _, pid in beside.run([(doubled, (0, 0.2))] * 4)} == {os.getpid()}:
        pass
    return beside


@pytest.fixture(scope="module")
def beside() -> Iterator[SideProcesses]:
    """One process beside this one."""
    with SideProcesses("math", count=1) as found:
        yield ready(found)


def test_results_are_in_the_order_of_the_jobs(beside: SideProcesses) -> None:
    jobs = [(doubled, (k, 0.05 if k % 3 == 0 else 0.0)) for k in range(12)]
    found = beside.run(jobs)
    assert [value for value, _ in found] == [2 * k for k in range(12)]
    assert {pid for _, pid in found} > {os.getpid()}, "both processes worked"
    assert beside.run([]) == []


def test_a_process_serves_one_list_after_the_other(beside: SideProcesses) -> None:
    first, second = (
        {pid for _, pid in beside.run([(doubled, (k, 0.1)) for k in range(4)])} for _ in range(2)
    )
    assert first == second


def test_what_a_job_prints_is_not_its_answer(beside: SideProcesses) -> None:
    assert beside.run([(noisy, (k,)) for k in range(6)]) == list(range(6))


def test_an_error_of_the_package_is_a_result(beside: SideProcesses) -> None:
    found = beside.run([(fails, (k,)) if k % 2 else (waits, (k, os.getpid())) for k in range(6)])
    for k, one in enumerate(found):
        assert str(one) == f"step {k} has no answer" if k % 2 else one[0] == 2 * k
        assert isinstance(one, ConvergenceError) == bool(k % 2)


@pytest.mark.parametrize("count", [0, 1])
def test_another_error_is_raised(count: int) -> None:
    with SideProcesses(count=count) as beside, pytest.raises(ZeroDivisionError):
        beside.run([(doubled, (1,)), (breaks, (2,)), (doubled, (3,))])


def test_an_error_beside_ends_a_long_list() -> None:
    """What waits is left, and what runs beside this process is ended."""
    with SideProcesses(count=1) as beside:
        here, begin = os.getpid(), time.perf_counter()
        with pytest.raises(ZeroDivisionError):
            beside.run([(waits, (0, here)), (breaks, (1,)), *[(doubled, (2, 0.5))] * 60])
        assert time.perf_counter() - begin < 20.0


def test_a_result_that_cannot_be_sent_is_an_error() -> None:
    """This process waits while the other finds it."""
    with SideProcesses(count=1) as beside:
        here = os.getpid()
        with pytest.raises((AttributeError, TypeError, pickle.PicklingError), match="lambda"):
            ready(beside).run([*[(waits, (0, here))] * 2, (unknown, (1,)), (unknown, (2,))])


def test_what_a_killed_process_held_is_done_here() -> None:
    with SideProcesses(count=2) as beside:
        here = os.getpid()
        found = beside.run([(waits, (0, here)), *[(dies, (k, here)) for k in range(1, 8)]])
        assert [value for value, _ in found] == [2 * k for k in range(8)]
        assert {pid for _, pid in found[1:]} == {here}
        # without any of them
        assert [value for value, _ in beside.run([(doubled, (k,)) for k in range(3)])] == [0, 2, 4]


def test_without_processes_all_is_done_here() -> None:
    with SideProcesses(count=0) as beside:
        found = beside.run([(doubled, (k,)) for k in range(5)])
        assert found == [(2 * k, os.getpid()) for k in range(5)]
        (error,) = beside.run([(fails, (3,))])
        assert isinstance(error, ConvergenceError)


def children() -> set[int]:
    """Processes that this one has started and that have not ended."""
    own = Path(f"/proc/self/task/{os.getpid()}/children")
    return {int(pid) for pid in own.read_text(encoding="ascii").split()}


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="reads /proc")
def test_left_they_end() -> None:
    before = children()
    with SideProcesses(count=99):
        assert len(children() - before) == MOST_BESIDE
    assert children() <= before


def test_a_script_needs_no_guard(tmp_path: Any) -> None:
    """Its own lines are not run again beside it."""
    script = tmp_path / "own.py"
    script.write_text(
        "print('once')\n"
        "import math\n"
        "from upd.linalg.processes import SideProcesses\n"
        "with SideProcesses(count=1) as beside:\n"
        "    print(beside.run([(math.sqrt, (9.0,)), (math.sqrt, (4.0,))]))\n"
    )
    told = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    assert told.stdout.split("\n")[:2] == ["once", "[3.0, 2.0]"]


@pytest.mark.skipif("PYTEST_XDIST_WORKER" not in os.environ, reason="of the workers of a whole set")
def test_workers_of_the_tests_share_the_cores() -> None:
    """Two threads of each on two cores wait for each other: a fit took ten times as long."""
    import numpy.linalg
    import scipy.linalg
    from threadpoolctl import threadpool_info

    assert numpy.linalg and scipy.linalg
    limit = int(os.environ["OPENBLAS_NUM_THREADS"])
    assert [one["num_threads"] for one in threadpool_info() if one["num_threads"] > limit] == []
