"""What every test runs with.

Two workers for the whole set, threads that fit them, a cache of their own; and the small scenes'
runs.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

from tests.pictures import no_figures

if TYPE_CHECKING:
    from upd.report.notebook import RunResult

#: The same examples in every run; ``--hypothesis-profile=search`` looks for new ones.
settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("search", deadline=None)
settings.load_profile("same")

#: Workers of a plain ``pytest``. More need more memory than a laptop has; ``pytest -n 8`` is
#: obeyed.
WORKERS = 2
#: Files that compile most loops, of the faces and of the springs: one begins each worker, so that
#: none compiles what the other does.
COMPILING = ("test_interface_balance", "test_choice")
#: Files of ten seconds or more, the longest first: begun then, none keeps one worker at the end.
LONG = (
    *("test_fit", "test_readme", "test_sweep_faults", "test_hertz_scene"),
    *("test_study", "test_answer", "test_contact_products", "test_measured_fit"),
    *("test_default_estimates", "test_modes", "test_graded_meshes"),
    *("test_response_estimates", "test_input_effects", "test_study_faults", "test_report"),
    *("test_scene_studies", "test_report_browser", "test_interface_march", "test_forced_scene"),
    *("test_contact_left_out", "test_doctests", "test_confirmed_peaks", "test_seated_estimates"),
    *("test_damping_over_amplitude", "test_sweep"),
    *("test_measured_runs", "test_input_uncertainty"),
)
#: Read by the libraries when they are loaded, which in a worker is after this file: nothing here
#: imports numpy at once.
THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
_OWN_CACHE = "UPD_TESTS_CACHE"


def _cores() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1


if "PYTEST_XDIST_WORKER_COUNT" in os.environ:
    for _name in THREADS:
        os.environ.setdefault(
            _name, str(max(1, _cores() // int(os.environ["PYTEST_XDIST_WORKER_COUNT"])))
        )


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """A plain ``pytest`` shares the files out to workers.

    One that chooses tests, prints or debugs stays in its own process.

    Not `addopts`: an option of pytest-xdist there would end a pytest without it (``-p no:xdist``).
    """
    if hasattr(config, "workerinput") or "PYTEST_XDIST_WORKER" in os.environ:
        return  # pytest asks each worker too: with workers of its own it would never end
    option = config.option
    everything = (
        config.args_source is pytest.Config.ArgsSource.TESTPATHS
        and option.markexpr == "not full"
        and not option.keyword
    )
    watched = option.usepdb or option.capture == "no"
    if (
        everything
        and not watched
        and getattr(option, "numprocesses", 0) is None
        and option.dist == "no"
    ):
        option.numprocesses, option.dist = min(WORKERS, _cores()), "loadfile"
        option.loadscopereorder = False


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Workers take the files that compile first, then the long ones."""
    order = {name: k for k, name in enumerate((*COMPILING, *LONG))}
    if "PYTEST_XDIST_WORKER" in os.environ:
        items.sort(key=lambda item: order.get(item.path.stem, len(order)))


def pytest_configure(config: pytest.Config) -> None:
    """Meshes and condensations of this session only, shared by its workers.

    Nothing old is found, nothing is left behind.
    """
    if "UPD_CACHE" not in os.environ:
        os.environ["UPD_CACHE"] = os.environ[_OWN_CACHE] = tempfile.mkdtemp(prefix="upd-tests-")


def pytest_unconfigure(config: pytest.Config) -> None:
    if not hasattr(config, "workerinput") and _OWN_CACHE in os.environ:
        shutil.rmtree(os.environ.pop(_OWN_CACHE), ignore_errors=True)
        del os.environ["UPD_CACHE"]


@pytest.fixture(scope="module", autouse=True)
def _estimates_where_asked(request: pytest.FixtureRequest) -> Iterator[None]:
    """Runs of modules that are not marked "estimated" have no companions unless an accuracy is
    given: a quarter of the whole set's time.
    """
    from upd.scene.base import SceneBase
    from upd.scene.quantities import UNKNOWN

    if request.node.get_closest_marker("estimated") is not None:
        yield
        return
    with pytest.MonkeyPatch.context() as patch:
        asked = property(lambda scene: scene.accuracy not in (None, UNKNOWN))
        patch.setattr(SceneBase, "estimates", asked)
        yield


@pytest.fixture
def without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs, sweeps and studies without figures and pages, which take longer than small scenes."""
    for taker in ("answer", "run_page", "sweep_page"):
        # first imported now, it would keep the replaced function for all tests after this one
        import_module(f"upd.report.{taker}")
    for name, written in {
        "upd.runner.write_figures": lambda *_: [],
        "upd.plot.matplotlib.write_sheets": lambda *_, **__: [],
        "upd.batch.sweeps.write_report": lambda folder: folder / "report.html",
        "upd.report.page.page_text": lambda *_, **__: "",
    }.items():
        monkeypatch.setattr(name, written)


#: Ready scene -> overrides that leave every kind of number, array and chart in it and take a second
#: or two.
SMALL: Mapping[str, Mapping[str, Any]] = {
    "hertz": {
        "geometry.divisions": 8,
        "geometry.patch": "auto",
        "loads.normal": ["200 N"],
        "loads.tangential": [0.5],
        "loads.curve_points": 3,
        "loads.cycle_steps": 40,
    },
    "symmetric": {
        "geometry.divisions": 4,
        "geometry.divisions_long": 8,
        "loads.normal": ["155 N"],
        "loads.tangential": [0.5],
        "law.rows": 2,
        "law.columns": 3,
    },
    "rig": {
        "mesh.element": "hex8",
        "want": ["free", "response"],
        "modes.arrangements": ["symmetric"],
        "response.points": 50,
    },
}


@pytest.fixture(scope="session")
def few_points() -> tuple[str, ...]:
    """Overrides that make the wedge's forced response a quick one."""
    from rigs import FEW_POINTS

    return FEW_POINTS


@pytest.fixture(scope="session")
def small_scenes() -> Mapping[str, Mapping[str, Any]]:
    """Overrides that make a ready scene a quick one, by its name."""
    return SMALL


@pytest.fixture(scope="session")
def small_run(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], RunResult]:
    """``small_run("hertz")`` is that small scene's result with its run folder (no page, no
    figures), solved once a session: leave both as they are.
    """

    @cache
    def solved(scene: str) -> RunResult:
        from upd import run

        with no_figures():
            return run(
                scene,
                overrides=dict(SMALL[scene]),
                out=tmp_path_factory.mktemp("small") / scene,
                report=False,
            )

    return solved
