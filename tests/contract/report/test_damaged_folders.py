"""Damaged run folders: one message that names the file, never another error, no changed arrays."""

from __future__ import annotations

import contextlib
import json
import random
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import upd
from upd import load
from upd.errors import InputError, UpdError
from upd.report import write_report
from upd.results import read_netcdf

SEED = 20240501
#: of each kind of mutation
TRIED = 13
VALUES = (None, 3, -1.5, "words", True, [], [1, 2], {}, {"a": 1})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with error parts and input parts, without pictures."""
    toy = {
        "geometry.divisions": 4,
        "geometry.patch": "auto",
        "loads.normal": ["200 N"],
        "want": ["normal"],
        "contact.friction": "0.6 +- 0.1",
        "accuracy": "20 %",
        "left_out.solve": "no",
    }
    path = tmp_path_factory.mktemp("toy") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("upd.runner.write_figures", lambda *_: [])
        upd.run("hertz", overrides=toy, out=path, report=False)
    shutil.rmtree(path / "curves")
    return path


def places(data: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Paths of all entries of a JSON value."""
    if not isinstance(data, (dict, list)):
        return
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        yield (*path, key)
        yield from places(value, (*path, key))


def holder(data: Any, path: tuple[str | int, ...]) -> Any:
    for key in path[:-1]:
        data = data[key]
    return data


def flipped(content: bytes, draw: random.Random) -> bytes:
    out = bytearray(content)
    out[draw.randrange(len(out))] ^= 1 << draw.randrange(8)
    return bytes(out)


def mutate(folder: Path, kind: str, draw: random.Random) -> str:
    """Damage one file of a folder; what was done."""
    summary, arrays = folder / "summary.json", folder / "result.nc"
    data = json.loads(summary.read_text("utf-8"))
    path = draw.choice(list(places(data)))
    if kind == "remove":
        del holder(data, path)[path[-1]]
    elif kind == "change":
        holder(data, path)[path[-1]] = draw.choice(VALUES)
    else:
        file = summary if kind.endswith("summary") else arrays
        content = file.read_bytes()
        cut = content[: draw.randrange(len(content))]
        file.write_bytes(cut if kind.startswith("cut") else flipped(content, draw))
        if kind.endswith("unsigned"):
            for name in ("result_nc_sha256", "sha256"):
                data.pop(name, None)
            summary.write_text(json.dumps(data), "utf-8")
        return kind
    summary.write_text(json.dumps(data), "utf-8")
    return f"{kind} {path}"


@pytest.mark.parametrize(
    "kind",
    [
        *("remove", "change", "cut summary", "flip summary"),
        *("cut arrays", "flip arrays", "cut arrays unsigned", "flip arrays unsigned"),
    ],
)
def test_only_errors_of_our_own(folder: Path, tmp_path: Path, kind: str) -> None:
    draw, faults = random.Random(f"{SEED} {kind}"), []
    for k in range(TRIED):
        copy = tmp_path / str(k)
        shutil.copytree(folder, copy)
        done = mutate(copy, kind, draw)
        try:
            with contextlib.suppress(UpdError):
                repr(load(copy))
            if not kind.endswith("unsigned"):
                with contextlib.suppress(UpdError):
                    write_report(copy)
        except Exception as error:
            faults.append(f"{done}: {type(error).__name__}: {error}")
        shutil.rmtree(copy)
    assert not faults


def test_every_flipped_bit_of_the_arrays_is_found(folder: Path, tmp_path: Path) -> None:
    copy, draw = tmp_path / "run", random.Random(SEED)
    shutil.copytree(folder, copy)
    whole = (copy / "result.nc").read_bytes()
    for _ in range(50):
        (copy / "result.nc").write_bytes(flipped(whole, draw))
        with pytest.raises(InputError, match=r"result\.nc: cannot be read .* run the scene again"):
            load(copy)
    with pytest.raises(OSError, match="SHA-256"):
        read_netcdf(copy / "result.nc")


def test_a_folder_from_before_the_digest_loads(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "run"
    shutil.copytree(folder, copy)
    data = json.loads((copy / "summary.json").read_text("utf-8"))
    assert len(data.pop("result_nc_sha256")) == len(data.pop("sha256")) == 64
    (copy / "summary.json").write_text(json.dumps(data), "utf-8")
    assert load(copy).arrays.keys() == load(folder).arrays.keys()


def test_a_changed_summary_is_named_with_the_remedy(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "run"
    shutil.copytree(folder, copy)
    data = json.loads((copy / "summary.json").read_text("utf-8"))
    assert load(copy).results
    data["results"][1]["value"] = 3.0
    (copy / "summary.json").write_text(json.dumps(data), "utf-8")
    with pytest.raises(InputError, match=r"summary\.json: is not as .* call upd run again"):
        load(copy)
    del data["cost"]
    (copy / "summary.json").write_text(json.dumps(data), "utf-8")
    with pytest.raises(InputError, match=r"summary\.json: is damaged in cost; call upd run again"):
        load(copy)
