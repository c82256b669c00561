"""Every benchmark as one Markdown table with the machine's description.

./run.sh python benchmarks/run.py                 all of them (several minutes)
./run.sh python benchmarks/run.py hertz assembly  those whose file name contains one of the words
"""

from __future__ import annotations

import importlib.util
import sys
import time
from pathlib import Path
from typing import Any

from upd.cli.doctor import machine
from upd.errors import UpdError

HERE = Path(__file__).parent
COLUMNS = ("name", "case", "value", "unit", "target", "note")


def load(path: Path) -> Any:
    """The module at ``path``."""
    spec = importlib.util.spec_from_file_location(f"benchmark_{path.parent.name}_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def cell(value: Any) -> str:
    """A table cell: four digits for numbers."""
    return f"{value:.4g}" if isinstance(value, float) else str(value if value is not None else "")


def main(words: list[str]) -> None:
    """Run the chosen benchmarks and print their rows."""
    print(f"Machine: {machine()}\n")
    print("| " + " | ".join(COLUMNS) + " |")
    print("|" + "---|" * len(COLUMNS))
    for path in sorted(HERE.glob("*/bench_*.py")):
        if words and not any(w in path.stem for w in words):
            continue
        begin = time.perf_counter()
        try:
            rows = load(path).run()
        except UpdError as error:
            rows = [{"name": path.stem, "note": f"failed: {error}"}]
        for row in rows:
            # Rows name their bound "target" or "reference".
            filled = {**row, "target": row.get("target", row.get("reference"))}
            print("| " + " | ".join(cell(filled.get(c)) for c in COLUMNS) + " |", flush=True)
        print(f"{path.stem}: {time.perf_counter() - begin:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main(sys.argv[1:])
