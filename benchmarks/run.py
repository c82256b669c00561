"""Every benchmark's rows, printed as CSV.

- ``./run.sh python benchmarks/run.py``: all of them;
- ``./run.sh python benchmarks/run.py hertz assembly``: those whose name (accuracy/hertz) contains
  one of the words; a whole name is that benchmark alone;
- ``./run.sh python benchmarks/run.py hertz --write``: the same, kept as
  benchmarks/results/accuracy-hertz.csv.

A file holds the rows of one benchmark with the machine that it ran on. Files of benchmarks that
were not run, failed or were skipped stay as they are.
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import io
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from upd.cache.files import write_text
from upd.cli.doctor import machine
from upd.errors import UpdError

HERE = Path(__file__).parent
COLUMNS = ("name", "case", "value", "unit", "target", "note", "machine")

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


def kept_in(folder: Path, name: str) -> Path:
    """The file of a benchmark's rows: accuracy/hertz is results/accuracy-hertz.csv."""
    return folder / "results" / f"{name.replace('/', '-')}.csv"


def chosen_by(words: Sequence[str], names: Sequence[str]) -> list[str]:
    """The names that contain one of the words, all without any; a whole name is that one alone."""
    return [
        name
        for name in names
        if not words or any(name == w or (w in name and w not in names) for w in words)
    ]


def cell(value: Any) -> str:
    """Four digits of a number, one line of a text."""
    if isinstance(value, float):
        return f"{value:.4g}"
    return " ".join(str("" if value is None else value).split())


def lines(rows: Iterable[Row], columns: Sequence[str] = COLUMNS) -> str:
    """Rows as CSV. They name their bound "target" or "reference"."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    for row in rows:
        filled = {**row, "target": row.get("target", row.get("reference"))}
        writer.writerow([cell(filled.get(column)) for column in columns])
    return text.getvalue()


def main(arguments: Sequence[str] | None = None, folder: Path = HERE) -> None:
    """Run the chosen benchmarks below ``folder`` and print their rows."""
    parser = argparse.ArgumentParser(description="Run benchmarks and print their rows as CSV.")
    parser.add_argument(
        "words",
        nargs="*",
        help="parts of names like accuracy/hertz, or whole ones; without any, all benchmarks",
    )
    parser.add_argument(
        "--write", action="store_true", help="keep the rows in results/ beside the benchmarks"
    )
    chosen = parser.parse_args(arguments)
    here = machine()
    print(f"Machine: {here}\n")
    print(",".join(COLUMNS[:-1]))
    paths = {title(path): path for path in sorted(folder.glob("*/bench_*.py"))}
    words = [word.removeprefix("bench_") for word in chosen.words]
    for name in chosen_by(words, list(paths)):
        begin = time.perf_counter()
        try:
            rows = list(load(paths[name]).run())
        except UpdError as error:
            rows = [{"name": name, "note": f"failed: {error}"}]
        print(lines(rows, COLUMNS[:-1]), end="", flush=True)
        if chosen.write and any(row.get("value") is not None for row in rows):
            file = kept_in(folder, name)
            file.parent.mkdir(exist_ok=True)
            head = dict(zip(COLUMNS, COLUMNS, strict=True))
            write_text(file, lines([head, *({**row, "machine": here} for row in rows)]))
        elif chosen.write:
            print(f"{name}: nothing was measured, its file in results/ stays", file=sys.stderr)
        print(f"{name}: {time.perf_counter() - begin:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
