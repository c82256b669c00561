"""Every benchmark as one Markdown table with the machine's description.

- ``./run.sh python benchmarks/run.py``: all of them;
- ``./run.sh python benchmarks/run.py hertz assembly``: those whose name (accuracy/hertz) contains
  one of the words; a whole name is that benchmark alone;
- ``./run.sh python benchmarks/run.py hertz --write``: the same, and put their rows into
  benchmarks/README.md.

``--write`` replaces what stands between two comments of that file: one section per benchmark, with
the machine it ran on. Sections of benchmarks that were not run, failed or were skipped stay as they
are.
"""

from __future__ import annotations

import argparse
import importlib.util
import re
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from upd.cache.files import write_text
from upd.cli.doctor import machine
from upd.errors import UpdError

HERE = Path(__file__).parent
COLUMNS = ("name", "case", "value", "unit", "target", "note")
HEAD = ("| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS))
#: the table lies between these two lines of README.md
BEGIN, END = "<!-- table:begin -->", "<!-- table:end -->"

Row = Mapping[str, Any]


def load(path: Path) -> Any:
    """The module at ``path``."""
    spec = importlib.util.spec_from_file_location(f"benchmark_{path.parent.name}_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def title(path: Path) -> str:
    """Name of the benchmark in a file: accuracy/bench_hertz.py is accuracy/hertz."""
    return f"{path.parent.name}/{path.stem.removeprefix('bench_')}"


def chosen_by(words: Sequence[str], names: Sequence[str]) -> list[str]:
    """The names that contain one of the words, all without any; a whole name is that one alone."""
    return [
        name
        for name in names
        if not words or any(name == w or (w in name and w not in names) for w in words)
    ]


def cell(value: Any) -> str:
    """A table cell: four digits for numbers, one line for texts."""
    return (
        f"{value:.4g}"
        if isinstance(value, float)
        else " ".join(str(value if value is not None else "").replace("|", r"\|").split())
    )


def line(row: Row) -> str:
    """A row of the table. Rows name their bound "target" or "reference"."""
    filled = {**row, "target": row.get("target", row.get("reference"))}
    return "| " + " | ".join(cell(filled.get(c)) for c in COLUMNS) + " |"


def section(rows: Iterable[Row], where: str) -> str:
    """What stands below a benchmark's heading: the machine and the table."""
    return "\n".join([f"{where}:", "", *HEAD, *map(line, rows)])


def sections(table: str) -> dict[str, str]:
    """Name of a benchmark -> what stands below its heading in the text between the comments."""
    parts = re.split(r"^### (.+)$", table, flags=re.MULTILINE)
    return {name.strip(): text.strip() for name, text in zip(parts[1::2], parts[2::2], strict=True)}


def replaced(text: str, new: Mapping[str, str]) -> str:
    """The text of README.md with the sections ``new`` put in.

    Raises ValueError when the two comments are not there.
    """
    found = re.fullmatch(f"(.*?{BEGIN}\n)(.*?)({END}.*)", text, flags=re.DOTALL)
    if found is None:
        raise ValueError(f"the lines {BEGIN} and {END} are not there; put them around the table")
    before, table, after = found.groups()
    kept = {**sections(table), **new}
    return (
        before + "".join(f"\n### {name}\n\n{kept[name]}\n" for name in sorted(kept)) + "\n" + after
    )


def write(path: Path, new: Mapping[str, str]) -> None:
    """Put sections into the file at ``path``, whole or not at all."""
    write_text(path, replaced(path.read_text(encoding="utf-8"), new))


def main(arguments: Sequence[str] | None = None, folder: Path = HERE) -> None:
    """Run the chosen benchmarks below ``folder`` and print their rows."""
    parser = argparse.ArgumentParser(
        description="Run benchmarks and print their rows as a Markdown table."
    )
    parser.add_argument(
        "words",
        nargs="*",
        help="parts of names like accuracy/hertz, or whole ones; all benchmarks when there are "
        "none",
    )
    parser.add_argument(
        "--write", action="store_true", help="put the rows into README.md beside the benchmarks"
    )
    chosen = parser.parse_args(arguments)
    if chosen.write:
        write(
            folder / "README.md", {}
        )  # whether it can be written is known before the first benchmark
    print(f"Machine: {machine()}\n")
    print("\n".join(HEAD))
    paths = {title(path): path for path in sorted(folder.glob("*/bench_*.py"))}
    words = [word.removeprefix("bench_") for word in chosen.words]
    for name in chosen_by(words, list(paths)):
        path = paths[name]
        begin = time.perf_counter()
        try:
            rows = list(load(path).run())
        except UpdError as error:
            rows = [{"name": path.stem, "note": f"failed: {error}"}]
        for row in rows:
            print(line(row), flush=True)
        if chosen.write and any(row.get("value") is not None for row in rows):
            write(folder / "README.md", {name: section(rows, machine())})
        elif chosen.write:
            print(f"{name}: nothing was measured, its rows in README.md stay", file=sys.stderr)
        print(f"{path.stem}: {time.perf_counter() - begin:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
