"""The manual: pages of the gallery run as notebooks, pages name what exists."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

MANUAL = Path(__file__).resolve().parents[3] / "upd" / "manual"
GALLERY = sorted((MANUAL / "gallery").glob("plot_*.py"))


@pytest.mark.parametrize("name", ["plot_05_statics", "plot_09_own_matrices", "plot_10_sweep"])
def test_a_page_of_the_gallery_runs_as_a_notebook(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The notebook that a reader downloads, cell by cell, from top to bottom."""
    gallery = pytest.importorskip("sphinx_gallery.notebook")
    parser = pytest.importorskip("sphinx_gallery.py_source_parser")
    conf = pytest.importorskip("sphinx_gallery.gen_gallery").DEFAULT_GALLERY_CONF
    source = MANUAL / "gallery" / f"{name}.py"
    _, blocks = parser.split_code_and_text_blocks(str(source))
    notebook = gallery.jupyter_notebook(blocks, dict(conf), str(tmp_path))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    cells = ["".join(c["source"]) for c in notebook["cells"] if c["cell_type"] == "code"]
    assert any("upd." in cell for cell in cells)
    names: dict[str, object] = {}
    for cell in cells:
        exec(compile(cell.replace("%matplotlib inline", ""), name, "exec"), names)
    assert json.dumps(notebook)


def test_the_gallery_has_at_least_ten_pages() -> None:
    assert len(GALLERY) >= 10


def test_every_page_is_in_a_table_of_contents() -> None:
    named = set()
    for page in MANUAL.rglob("*.md"):
        for block in re.findall(r"```{toctree}(.*?)```", page.read_text("utf-8"), re.DOTALL):
            base = page.parent.relative_to(MANUAL)
            named |= {str(base / line) for line in block.split() if not line.startswith(":")}
    pages = {str(p.relative_to(MANUAL).with_suffix("")) for p in MANUAL.rglob("*.md")} - {"index"}
    assert pages <= named
