"""Files of measured curves: what is understood, and every fault with its line and column."""

from __future__ import annotations

from pathlib import Path

import h5netcdf
import numpy as np
import pytest

from upd.errors import InputError
from upd.measured import read_measured

HEAD = "frequency [Hz],accelerance [(m/s2)/N]\n"


def file(folder: Path, text: str, name: str = "curve.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (HEAD + "1,2\n2,3\n3,4\n", [2.0, 3.0, 4.0]),
        (
            "# said\n\nfrequency (kHz)\taccelerance ((mm/s2)/N)\n1\t2\n2\t3\n3\t4\n",
            [2e-3, 3e-3, 4e-3],
        ),
        ("freq [Hz];accelerance [g/N]\n1,5;2,5\n2,5;3\n3,5;4\n", np.array([2.5, 3, 4]) * 9.80665),
        (
            "frequency [Hz],H real [(m/s2)/N],H imag [(m/s2)/N]\n1,3,4\n2,0,1\n3,1,0\n",
            [3 + 4j, 1j, 1],
        ),
        (
            "frequency [Hz],H amplitude [(m/s2)/N],H phase [deg]\n1,2,90\n2,1,0\n3,1,180\n",
            [2j, 1, -1],
        ),
        (HEAD + "3,4\n2,3\n1,2\n", [2.0, 3.0, 4.0]),
        (
            '"f [kHz]","Abs(x) [(m/s2)/N]","Phi(x) [rad]"\n'
            + "".join(f"{f},1,{np.pi / 2}\n" for f in (1, 2, 3)),
            [1j, 1j, 1j],
        ),
        (
            "Frequency [Hz],Magnitude [(m/s2)/N],Phase angle [deg]\n1,2,90\n2,1,0\n3,1,180\n",
            [2j, 1, -1],
        ),
        (
            "frequency [Hz],Re(H(f)) [1/kg],Im(H(f)) [1/kg]\n1,3,4\n2,0,1\n3,1,0\n",
            [3 + 4j, 1j, 1],
        ),
    ],
    ids=[
        "comma",
        "tab",
        "decimal comma",
        "complex",
        "phase",
        "falling",
        "Abs and Phi",
        "phase angle",
        "Re and Im",
    ],
)
def test_understood(tmp_path: Path, text: str, expected: object) -> None:
    curve = read_measured(file(tmp_path, text))
    assert curve.accelerance == pytest.approx(np.array(expected))
    assert (np.diff(curve.frequency) > 0.0).all()


def test_mobility_and_receptance_are_differentiated(tmp_path: Path) -> None:
    """a = i omega v = -omega^2 x, with its phase; without it the modulus."""
    omega = 2.0 * np.pi * np.array([1.0, 2.0, 3.0])
    for unit, turn in (("(m/s)/N", 1j * omega), ("m/N", -(omega**2))):
        head = f"frequency [Hz],H re [{unit}],H im [{unit}]\n"
        curve = read_measured(file(tmp_path, head + "1,1,0\n2,1,0\n3,1,0\n"))
        assert curve.accelerance == pytest.approx(turn)
        bare = read_measured(file(tmp_path, "1,1\n2,1\n3,1\n", "bare.txt"), unit=unit)
        assert bare.accelerance == pytest.approx(np.abs(turn))


def test_every_fault_with_line_and_column(tmp_path: Path) -> None:
    text = "# comment\n" + HEAD + "1,2\n2,abc\n3,inf\n,5\n5\n6,1,7\n"
    with pytest.raises(InputError) as caught:
        read_measured(file(tmp_path, text))
    told = str(caught.value)
    assert "curve.csv: 5 problems" in told
    for fault in (
        "line 4, column 2 (accelerance): 'abc'",
        "line 5, column 2 (accelerance): 'inf'",
        "line 6, column 1 (frequency): nothing there",
        "line 7, column 2 (accelerance): nothing there",
        "line 8: 3 cells where there are 2 columns",
    ):
        assert fault in told


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "line 1: no values"),
        (HEAD + "1,2\n2,3\n", "line 3: ends with 2 points"),
        (HEAD + "1,2\n3,3\n2,3\n4,4\n", r"line 4, column 1 \(frequency\): 2 Hz comes after 3 Hz"),
        (HEAD + "1,2\n1,3\n2,3\n", r"line 3, column 1 \(frequency\): 1 Hz comes after 1 Hz"),
        (HEAD + "0,2\n1,3\n2,3\n", r"line 2, column 1 \(frequency\): 0 Hz is not"),
        (HEAD + "1,2\n2,-3\n3,3\n", r"line 3, column 2 \(accelerance\): the magnitude -3"),
        ("frequency [Hz],H [furlong]\n1,2\n2,3\n", r"line 1, column 2 \(H\): the unit 'furlong'"),
        ("frequency [Hz],H [mm]\n1,2\n2,3\n", "'mm' is a unit of length"),
        ("frequency [Hz],H\n1,2\n2,3\n", r"line 1, column 2 \(H\): no unit"),
        ("frequency,H [m/N]\n1,2\n2,3\n", r"line 1, column 1 \(frequency\): no unit"),
        ("time [s],H [m/N]\n1,2\n2,3\n", "line 1: no column of frequency"),
        ("frequency [Hz],H real [m/N]\n1,2\n2,3\n", "has a column real but none imaginary"),
        ("frequency [Hz],a [m/N],b [m/N]\n1,2,3\n", "line 1: 2 responses, a, b; name one"),
        (HEAD, "line 1: ends with 0 points"),
        ("frequency [Hz],Magnitude (dB)\n1,2\n2,3\n3,4\n", "column 2 .*: values in dB are not"),
        ("frequency [Hz],H [1/kg],H [1/kg]\n1,2,3\n2,3,4\n", "several columns H; give each"),
    ],
)
def test_faults_are_told_with_the_remedy(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        read_measured(file(tmp_path, text))


@pytest.mark.parametrize(
    ("head", "told"),
    [
        ("Magnitude (dB)", "values in dB"),
        ("H_dB", "values in dB"),
        ("Magnitude [dB re 1 g/N]", "values in dB"),
        ("accelerance [g/N]", r"the file gives its unit, 'g/N', but unit = '\(m/s2\)/N'; remove"),
        ("accelerance [furlong]", "the file gives its unit, 'furlong', but unit"),
    ],
)
def test_a_unit_beside_the_file_does_not_overrule_it(tmp_path: Path, head: str, told: str) -> None:
    path = file(tmp_path, f"frequency [Hz],{head}\n1,2\n2,3\n3,4\n")
    with pytest.raises(InputError, match=told):
        read_measured(path, unit="(m/s2)/N")


def test_a_unit_beside_the_file_may_repeat_it(tmp_path: Path) -> None:
    curve = read_measured(file(tmp_path, HEAD + "1,2\n2,3\n3,4\n"), unit="m/s2/N")
    assert curve.magnitude.tolist() == [2.0, 3.0, 4.0]


def test_a_phase_that_belongs_to_no_response(tmp_path: Path) -> None:
    head = "frequency [Hz],a [1/kg],turn [deg],b [1/kg],lag [deg]\n"
    path = file(tmp_path, head + "1,2,3,4,5\n2,3,4,5,6\n3,4,5,6,7\n")
    with pytest.raises(InputError, match=r'column 3 \(turn\): a phase .* name it "a phase"'):
        read_measured(path, column="a")


def test_what_is_no_text_or_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_measured(tmp_path / "none.csv")
    path = tmp_path / "curve.csv"
    path.write_bytes(b"frequency [Hz],x\n\xff\xfe")
    with pytest.raises(InputError, match="line 2: is no text in UTF-8"):
        read_measured(path)
    with pytest.raises(InputError, match=r"cannot be read .* netCDF-4"):
        read_measured(file(tmp_path, "1,2", "curve.nc"))


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    path = file(tmp_path, HEAD + "1,2\n2,3\n3,4\n")
    assert read_measured(path).magnitude[0] == 2.0
    path.write_text(HEAD + "1,20\n2,30\n3,40\n", encoding="utf-8")
    assert read_measured(path).magnitude[0] == 20.0


def netcdf(path: Path, units: str, data: np.ndarray, f: np.ndarray) -> Path:
    with h5netcdf.File(path, "w") as out:
        group = out.create_group("lab")
        group.dimensions = {"frequency": len(f), "part": 2}
        group.create_variable("frequency", ("frequency",), data=f).attrs["units"] = "Hz"
        dims = ("frequency", "part")[: data.ndim]
        group.create_variable("H", dims, data=data).attrs["units"] = units
    return path


def test_netcdf(tmp_path: Path) -> None:
    f, parts = np.array([1.0, 2.0, 3.0]), np.array([[3.0, 4.0], [0.0, 1.0], [1.0, 0.0]])
    path = netcdf(tmp_path / "a.nc", "(m/s2)/N", parts, f)
    assert read_measured(path).accelerance == pytest.approx(np.array([3 + 4j, 1j, 1]))
    assert read_measured(path, column="lab/H").is_complex
    with pytest.raises(InputError, match="no response 'lab/x' among the variables"):
        read_measured(path, column="lab/x")
    with pytest.raises(InputError, match="the file gives its unit"):
        read_measured(path, unit="g/N")
    bad = netcdf(tmp_path / "b.nc", "(m/s2)/N", np.array([1.0, np.nan, -2.0]), f)
    with pytest.raises(InputError, match=r"variable lab/H, place \[1\]: no finite number"):
        read_measured(bad)


CAMPAIGN = (
    "frequency [Hz];blade;state;F_C/F_E;accelerance [(m/s2)/N]\n"
    + "".join(f"{f};right;free;;{f},5\n" for f in (1, 2, 3))
    + "".join(f"{f};Right;;194,0;{2 * f}\n" for f in (1, 2, 3, 4))
    + "".join(f"{f};left;;194,0;{3 * f}\n" for f in (2, 3, 4))
)


def test_a_file_of_several_curves(tmp_path: Path) -> None:
    path = file(tmp_path, CAMPAIGN)
    free = read_measured(path, state="free")
    assert (free.blade, free.state, free.force_ratio) == ("right", "free", None)
    assert free.magnitude.tolist() == [1.5, 2.5, 3.5]
    left = read_measured(path, blade="left")
    assert (left.blade, left.state, left.force_ratio) == ("left", None, 194.0)
    assert left.magnitude.tolist() == [6.0, 9.0, 12.0]
    assert len(read_measured(path, blade="right", force_ratio=194).frequency) == 4


@pytest.mark.parametrize(
    ("wanted", "told"),
    [
        ({}, r"line 1: 3 curves, blade right, state free; blade right, F_C/F_E 194; blade left"),
        ({"blade": "left", "state": "free"}, "line 1: no curve of blade left, state free; the fil"),
        ({"force_ratio": 600.0}, "line 1: no curve of F_C/F_E 600"),
    ],
)
def test_a_curve_that_the_file_does_not_tell(tmp_path: Path, wanted: dict, told: str) -> None:
    with pytest.raises(InputError, match=told):
        read_measured(file(tmp_path, CAMPAIGN), **wanted)


def test_labels_that_say_nothing_known(tmp_path: Path) -> None:
    text = CAMPAIGN.replace("left", "middle", 1).replace("194,0", "often", 1)
    with pytest.raises(InputError) as caught:
        read_measured(file(tmp_path, text))
    told = str(caught.value)
    assert "line 5, column 4 (force_ratio): 'often' is no F_C/F_E" in told
    assert "line 9, column 2 (blade): 'middle' is no blade; write left or right" in told


def test_netcdf_attributes_say_the_curve(tmp_path: Path) -> None:
    f = np.array([1.0, 2.0, 3.0])
    path = netcdf(tmp_path / "a.nc", "(m/s2)/N", f, f)
    with h5netcdf.File(path, "a") as out:
        group = out["lab"]
        group.attrs["blade"], group.attrs["centrifugal_to_force"] = "left", 194.0
        other = group.create_variable("G", ("frequency",), data=2.0 * f)
        other.attrs["units"], other.attrs["blade"] = "(m/s2)/N", "right"
    assert read_measured(path, blade="right").magnitude.tolist() == [2.0, 4.0, 6.0]
    left = read_measured(path, column="lab/H")
    assert (left.blade, left.force_ratio) == ("left", 194.0)
    with pytest.raises(InputError, match=r"2 responses|no curve of"):
        read_measured(path, blade="right", force_ratio=600.0)
    with pytest.raises(InputError, match="2 responses"):
        read_measured(path)
