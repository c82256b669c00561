"""The page of a run in a real browser.

No errors, figures at both widths, a tooltip, no sideways scrolling, pictures without script; the
answer and its chart on the first screen, legends that leave the charts their place.
"""

from __future__ import annotations

import asyncio
import base64
import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upd import run
from upd.analyses.contact.analysis import ANALYSES
from upd.plot.answer_table import AnswerTable
from upd.plot.chart import Axis, Chart, Mark, Trace
from upd.report import write_report
from upd.report.page import Section, page_text, write_page

PHONE, DESK, SCREEN = 390, 1280, 800
#: pixels of a page that opens on its answer, where all else is folded
HIGHEST = 6000
#: part of a chart that its legend may take
LEGEND = 0.25
_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_BROWSER = next((found for name in _NAMES if (found := shutil.which(name))), None)
pytestmark = [
    pytest.mark.estimated,
    pytest.mark.skipif(_BROWSER is None, reason=f"none of {', '.join(_NAMES)} is on the PATH"),
]
tornado = pytest.importorskip(
    "tornado.websocket",
    reason="tornado, which the extra updampers[cluster] brings, drives the browser",
)

_START_S, _LOAD_S = 30.0, 30.0


class Tab:
    """A page driven over the DevTools protocol.

    Every message of the page's console and every request is kept.
    """

    def __init__(self, connection: Any) -> None:
        self._connection, self._number = connection, 0
        self.events: list[dict[str, Any]] = []

    async def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Result of one command."""
        self._number += 1
        await self._connection.write_message(
            json.dumps({"id": self._number, "method": method, "params": parameters})
        )
        while True:
            message = json.loads(await asyncio.wait_for(self._connection.read_message(), _LOAD_S))
            if message.get("id") == self._number:
                assert "error" not in message, (method, message["error"])
                return dict(message["result"])
            self.events.append(message)

    async def value(self, expression: str) -> Any:
        """Value of a JavaScript expression."""
        found = await self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    async def until(self, expression: str) -> None:
        """Wait until a JavaScript expression is true."""
        for _ in range(int(_LOAD_S / 0.1)):
            if await self.value(expression):
                return
            await asyncio.sleep(0.1)
        raise AssertionError(f"never true: {expression}")

    async def open(self, page: Path, width: int, *, script: bool = True) -> None:
        """Open a file at a width of the window, with or without script, and wait until it is drawn."""
        for domain in ("Page", "Runtime", "Log", "Network"):
            await self.call(f"{domain}.enable")
        await self.call("Emulation.setScriptExecutionDisabled", value=not script)
        await self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=SCREEN,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        await self.call("Page.navigate", url=page.as_uri())
        # Without script there is nothing to wait for but the document itself.
        await (
            self.until("Boolean(document.documentElement?.classList.contains('ready'))")
            if script
            else asyncio.sleep(1.0)
        )

    async def screenshot(self, path: Path) -> None:
        """The whole page as PNG."""
        size = (await self.call("Page.getLayoutMetrics"))["cssContentSize"]
        clip = {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}
        shot = await self.call("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)
        path.write_bytes(base64.b64decode(shot["data"]))

    def faults(self) -> list[str]:
        """Errors and warnings of the console, and exceptions."""
        out = [
            str(e["params"]["exceptionDetails"])
            for e in self.events
            if e.get("method") == "Runtime.exceptionThrown"
        ]
        out += [
            str(e["params"])
            for e in self.events
            if e.get("method") == "Runtime.consoleAPICalled" and e["params"]["type"] == "error"
        ]
        entries = (e["params"]["entry"] for e in self.events if e.get("method") == "Log.entryAdded")
        return out + [entry["text"] for entry in entries if entry["level"] == "error"]

    def requests(self) -> list[str]:
        """Addresses the page asked for, data URIs and itself left out."""
        urls = [
            e["params"]["request"]["url"]
            for e in self.events
            if e.get("method") == "Network.requestWillBeSent"
        ]
        return [u for u in urls if not u.startswith(("data:", "blob:")) and not u.endswith(".html")]


def drive(task: Callable[[Tab], Any], profile: Path) -> Any:
    """Run ``task`` in a tab of a browser of its own."""
    assert _BROWSER is not None
    command = [
        _BROWSER,
        "--headless",
        "--no-sandbox",
        "--disable-gpu-sandbox",
        "--hide-scrollbars",
        "--remote-debugging-port=0",
    ]
    command += ["--enable-unsafe-swiftshader", f"--user-data-dir={profile}", "about:blank"]
    with (profile.parent / "browser.log").open("wb") as log:
        # What it leaves in the temporary folder goes with the test's.
        process = subprocess.Popen(
            command, stdout=log, stderr=log, env=os.environ | {"TMPDIR": str(profile.parent)}
        )
    try:
        return asyncio.run(_connected(task, profile))
    finally:
        process.terminate()
        process.wait(timeout=10)


async def _connected(task: Callable[[Tab], Any], profile: Path) -> Any:
    from tornado.httpclient import AsyncHTTPClient

    port_file = profile / "DevToolsActivePort"
    for _ in range(int(_START_S / 0.1)):
        if port_file.exists() and port_file.read_text().count("\n"):
            break
        await asyncio.sleep(0.1)
    port = int(port_file.read_text().split("\n")[0])
    pages = json.loads((await AsyncHTTPClient().fetch(f"http://127.0.0.1:{port}/json")).body)
    address = next(p["webSocketDebuggerUrl"] for p in pages if p["type"] == "page")
    connection = await tornado.websocket_connect(address, max_message_size=200_000_000)
    try:
        tab = Tab(connection)
        found = await task(tab)
        await tab.call("Browser.close")
        return found
    finally:
        connection.close()


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The page of a small run whose title tries to be a script."""
    folder = tmp_path_factory.mktemp("report") / "hertz"
    scene = {
        "geometry.divisions": 12,
        "loads.normal": ["200 N"],
        "loads.curve_points": 3,
        "loads.cycle_steps": 40,
        "title": "<script>document.title = 'taken'</script> Hertz",
    }
    run(
        "hertz",
        overrides=[f"{key}={json.dumps(value)}" for key, value in scene.items()],
        out=folder,
        report=False,
    )
    yield write_report(folder)


#: as many numbers as the answer of a forced response has
ANSWER = [
    AnswerTable("Static state", ("state", "# normal N", "# ±"), (("rest", "212.4", "±1 %"),) * 2),
    AnswerTable(
        "Peaks",
        ("# F_C/F_E", "mode", *(f"# number {k}" for k in range(8)), "fold"),
        (("194", "out of phase", *("427.72",) * 8, "397.1 to 398.2 Hz"),) * 8,
        "What the columns mean, in a sentence that needs more than one line beside the chart.",
    ),
    AnswerTable("Best F_C/F_E", ("mode", "# F_C/F_E"), (("in phase", "58.2"),) * 2),
    AnswerTable("What it depends on", ("what", "# moves it"), (("friction", "±21 %"),) * 4),
]


@pytest.fixture(scope="module")
def answered(page: Path) -> Path:
    """The page of the same run, opened on tables of an answer."""
    before, path = page.read_bytes(), page.with_name("answered.html")
    with pytest.MonkeyPatch.context() as patch:
        hertz = replace(ANALYSES["hertz"], answer=lambda _: ANSWER)
        patch.setitem(ANALYSES, "hertz", hertz)
        write_report(page.parent).rename(path)
    page.write_bytes(before)
    return path


def _crowd(entries: int) -> Chart:
    """A response with a long legend and peaks close to each other, at both ends too."""
    f = np.linspace(280.0, 500.0, 300)
    peaks = ((281.0, 300.0), (345.0, 180.0), (347.7, 185.0), (350.0, 170.0), (499.0, 150.0))
    traces = tuple(
        Trace(
            f"centrifugal over exciting force {k}",
            f,
            1.0 + peaks[k % 5][1] / (1.0 + (f - peaks[k % 5][0]) ** 2),
            colour=k,
        )
        for k in range(entries)
    )
    marks = tuple(Mark(x, y, f"{x:.1f} Hz\n{y:.0f}", k) for k, (x, y) in enumerate(peaks))
    axes = Axis("frequency", "Hz", low=280.0, high=500.0), Axis("accelerance", log=True)
    return Chart("Response", *axes, traces, marks=marks, figure=f"response_{entries}")


#: of every drawn chart: rectangles of its legend, its drawing and the words in it, and its own:
#: left, top, right, bottom
_BOXES = """[...document.querySelectorAll('.plot')].filter((p) => p._fullLayout).map(function (p) {
  const box = (e) => { const b = e.getBoundingClientRect(); return [b.left, b.top, b.right, b.bottom]; };
  const one = (name) => { const e = p.querySelector(name); return e && box(e); };
  return {legend: one('.legend .bg'), frame: one('.nsewdrag'), all: one('.main-svg'),
    words: [...p.querySelectorAll('.textpoint text')].map(box)};
})"""
#: opens what is folded
_UNFOLD = "document.querySelectorAll('details.fold').forEach((d) => { d.open = true; })"
_ALL_DRAWN = "[...document.querySelectorAll('.panel:not(.image)')].every((p) => p.classList.contains('drawn'))"
#: lower ends of the tables of the answer and of the first chart, in the window
_OPENING = """({tables: [...document.querySelectorAll('.opening .grid')].map((e) => e.getBoundingClientRect().bottom),
  chart: document.querySelector('.opening .plot .main-svg').getBoundingClientRect().bottom,
  live: [...document.querySelectorAll('.plot')].filter((p) => p.querySelector('.main-svg')).length,
  height: document.documentElement.scrollHeight, width: document.documentElement.scrollWidth})"""


def _lie_on_each_other(a: list[float], b: list[float]) -> bool:
    """Whether two rectangles have more than rounding in common."""
    return min(a[2], b[2]) - max(a[0], b[0]) > 0.5 and min(a[3], b[3]) - max(a[1], b[1]) > 0.5


def _area(box: list[float]) -> float:
    return (box[2] - box[0]) * (box[3] - box[1])


async def _crowded(tab: Tab, page: Path) -> dict[str, Any]:
    """Rectangles of crowded charts at both widths."""
    write_page(page, page_text("t", [Section("Figures", charts=[_crowd(5), _crowd(30)])]))
    out = {}
    for width in (PHONE, DESK):
        await tab.open(page, width)
        out[f"{width}"] = await tab.value(_BOXES)
    return out | {"faults": tab.faults()}


async def _opened(tab: Tab, page: Path, width: int) -> dict[str, Any]:
    """A page that opens on its answer: as it comes, and with all that is folded opened."""
    await tab.open(page, width)
    found = {"opening": await tab.value(_OPENING)}
    await tab.value(_UNFOLD)
    await tab.until(_ALL_DRAWN)
    found["boxes"] = await tab.value(_BOXES)
    found["unfolded_width"] = await tab.value("document.documentElement.scrollWidth")
    return found | {"faults": tab.faults(), "requests": tab.requests()}


#: drawn figures and their widths; a chart is an SVG with curves or a map in it, the view in three
#: dimensions a canvas
_FIGURES = """[...document.querySelectorAll('.panel')].map(function (p) {
  const drawn = p.querySelector('.plot .main-svg, canvas'), image = p.querySelector('details.static[open] img');
  const box = (drawn || image).getBoundingClientRect();
  return {name: p.dataset.panel || p.id, live: Boolean(drawn), width: box.width, height: box.height, right: box.right};
})"""
#: middle of the first curve of the first chart, in the window
_POINT = """(function () {
  const plot = [...document.querySelectorAll('.plot')].find((p) => p._fullData.every((t) => t.type === 'scatter'));
  plot.scrollIntoView({block: 'center'});
  const box = plot.getBoundingClientRect(), layout = plot._fullLayout, trace = plot._fullData[0], k = Math.floor(trace.x.length / 2);
  return {x: box.left + layout._size.l + layout.xaxis.d2p(trace.x[k]), y: box.top + layout._size.t + layout.yaxis.d2p(trace.y[k])};
})()"""


#: every choice of every chart, and all controls of the view in three dimensions; how many were
#: tried
_CHOICES = """(function () {
  let n = 0;
  document.querySelectorAll('.panel select').forEach(function (choice) {
    for (let k = 0; k < choice.options.length; k++) {
      choice.selectedIndex = k; n += 1;
      ['input', 'change'].forEach((kind) => choice.dispatchEvent(new Event(kind)));
    }
  });
  ['view-apart', 'view-near'].forEach((id) => document.getElementById(id).click());
  const range = document.getElementById('view-scale');
  range.value = 100;
  range.dispatchEvent(new Event('input'));
  return {n: n, factor: document.getElementById('view-factor').textContent};
})()"""
_CAMERA = (
    "JSON.stringify(document.getElementById('view-plot')._fullLayout.scene._scene.getCamera().eye)"
)


async def _turned(tab: Tab) -> bool:
    """Whether the view turns when the mouse drags it."""
    box = await tab.value(
        """(function () { const plot = document.getElementById('view-plot'); plot.scrollIntoView({block: 'center'});
        const b = plot.getBoundingClientRect(); return {x: b.left + b.width / 2, y: b.top + b.height / 2}; })()"""
    )
    before = await tab.value(_CAMERA)
    for kind, shift in (
        ("mousePressed", 0),
        ("mouseMoved", 30),
        ("mouseMoved", 80),
        ("mouseReleased", 80),
    ):
        await tab.call(
            "Input.dispatchMouseEvent",
            type=kind,
            x=box["x"] + shift,
            y=box["y"],
            button="left",
            buttons=1,
            clickCount=1,
        )
        await asyncio.sleep(0.2)
    return bool(before != await tab.value(_CAMERA))


async def _looked_at(tab: Tab, page: Path, width: int) -> dict[str, Any]:
    await tab.open(page, width)
    await tab.value(_UNFOLD)
    await tab.until(_ALL_DRAWN)
    found = {
        "figures": await tab.value(_FIGURES),
        "page_width": await tab.value("document.documentElement.scrollWidth"),
        "boxes": await tab.value(_BOXES),
    }
    found["title"] = await tab.value("document.title")
    point = await tab.value(_POINT)
    # The tooltip follows a pointer that moves, not one that is there.
    for shift in (3, 0):
        await tab.call(
            "Input.dispatchMouseEvent",
            type="mouseMoved",
            x=point["x"] + shift,
            y=point["y"] + shift,
        )
        await asyncio.sleep(0.2)
    await tab.until("Boolean(document.querySelector('.hoverlayer .hovertext'))")
    found["tooltip"] = await tab.value(
        "document.querySelector('.hoverlayer .hovertext').textContent"
    )
    if width == DESK:
        found |= {"choices": await tab.value(_CHOICES), "turned": await _turned(tab)}
    return found | {"faults": tab.faults(), "requests": tab.requests()}


@pytest.fixture(scope="module")
def seen(page: Path, answered: Path) -> dict[str, Any]:
    """What the browser shows: at both widths, and without script."""

    async def look(tab: Tab) -> dict[str, Any]:
        widths = {str(width): await _looked_at(tab, page, width) for width in (PHONE, DESK)}
        widths["answered"] = {str(w): await _opened(tab, answered, w) for w in (PHONE, DESK)}
        widths["crowded"] = await _crowded(tab, page.parent.parent / "crowd.html")
        await tab.open(page, PHONE, script=False)
        images = (
            "[...document.images].map((i) => ({width: i.getBoundingClientRect().width, "
            "natural: i.naturalWidth}))"
        )
        dead = (
            "[...document.querySelectorAll('.needs-js')].filter((e) => e.offsetParent !== "
            "null).length"
        )
        still = {"images": await tab.value(images), "dead": await tab.value(dead)}
        return widths | {
            "still": still | {"page_width": await tab.value("document.documentElement.scrollWidth")}
        }

    return dict(drive(look, page.parent / "profile"))


@pytest.mark.parametrize("width", [PHONE, DESK])
def test_page_opens_without_errors_and_asks_for_nothing(seen: dict[str, Any], width: int) -> None:
    assert seen[str(width)]["faults"] == []
    assert seen[str(width)]["requests"] == []


@pytest.mark.parametrize("width", [PHONE, DESK])
def test_figures_are_visible_and_nothing_scrolls_sideways(seen: dict[str, Any], width: int) -> None:
    found = seen[str(width)]
    assert found["page_width"] == width
    assert {f["name"] for f in found["figures"]} >= {
        "pressure",
        "stick_slip",
        "traction",
        "force_approach",
        "hysteresis",
        "view3d",
    }
    for figure in found["figures"]:
        # The drawing of the recipe's dimensions is a picture.
        assert figure["live"] or figure["name"] == "dimensions", figure
        assert 0.75 * min(width, 540) < figure["width"] and figure["height"] > 150, figure
        assert figure["right"] <= width, figure


@pytest.mark.parametrize("width", [PHONE, DESK])
def test_hover_shows_values_with_their_units(seen: dict[str, Any], width: int) -> None:
    assert re.search(r"x: .*µm.*pressure: [\d.]+ MPa", seen[str(width)]["tooltip"])


def test_choices_and_the_view_in_three_dimensions_answer(seen: dict[str, Any]) -> None:
    found = seen[str(DESK)]
    # Four states of stick and slip, two fields.
    assert found["choices"]["n"] == 6
    assert re.fullmatch(r"× [\d,.]+", found["choices"]["factor"])
    assert found["turned"]


def test_a_title_stays_text(seen: dict[str, Any]) -> None:
    assert seen[str(DESK)]["title"] == "<script>document.title = 'taken'</script> Hertz"


def test_figures_remain_without_script(seen: dict[str, Any]) -> None:
    still = seen["still"]
    assert len(still["images"]) == 7
    assert all(
        image["natural"] > 400 and image["width"] > 0.75 * PHONE for image in still["images"]
    )
    assert still["dead"] == 0
    assert still["page_width"] == PHONE


@pytest.mark.parametrize("width", [PHONE, DESK])
def test_words_and_legends_cover_nothing(seen: dict[str, Any], width: int) -> None:
    few, many = seen["crowded"][str(width)]
    assert seen["crowded"]["faults"] == []
    for chart in (few, many, *seen[str(width)]["boxes"], *seen["answered"][str(width)]["boxes"]):
        if chart["legend"]:
            assert not _lie_on_each_other(chart["legend"], chart["frame"])
            assert _area(chart["legend"]) <= LEGEND * _area(chart["all"])
            assert _area(chart["frame"]) >= LEGEND * _area(chart["all"]), "the drawing is lost"
    for chart in (few, many):
        # Of three peaks close to each other the highest has words.
        assert len(chart["words"]) == 3
        for box in chart["words"]:
            assert chart["frame"][0] <= box[0] and box[2] <= chart["frame"][2], "words are cut"
            assert chart["frame"][1] <= box[1], "words stand above the drawing"
            assert not any(_lie_on_each_other(box, b) for b in chart["words"] if b is not box)


@pytest.mark.parametrize("width", [PHONE, DESK])
def test_a_page_opens_on_its_answer(seen: dict[str, Any], width: int) -> None:
    found = seen["answered"][str(width)]
    assert found["faults"] == found["requests"] == []
    opening = found["opening"]
    assert opening["width"] == found["unfolded_width"] == width, "it scrolls sideways"
    assert opening["height"] < HIGHEST
    assert len(opening["tables"]) == len(ANSWER)
    assert opening["live"] < len(found["boxes"]), "what is folded waits until it is opened"
    if width == DESK:
        assert max(*opening["tables"], opening["chart"]) <= SCREEN
