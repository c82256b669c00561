"""What a fit aims at: named numbers of a response's linear limits, with how well they are known."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from upd.analyses.forced.peak_results import LEFT
from upd.errors import InputError
from upd.scene.forced import SIDES, Side
from upd.scene.uncertain import read_band
from upd.units import unit_inside

STUCK_MODES = ("stuck_in_phase", "stuck_out_of_phase")
#: peaks of a blade's linear limits that have names
_PEAKS = (1, 2)
#: what a peak has, and the kind of its quantity
_OF_PEAK = {"frequency": "frequency", "accelerance": "accelerance"}
#: name of a peak's number -> free or stuck, its blade, number, and what of it
PEAK_NUMBERS: dict[str, tuple[str, Side, int, str]] = {
    f"{kind}_{LEFT * (side == 'left')}peak_{k}_{what}": (kind, side, k, what)
    for kind in ("free", "stuck")
    for side in SIDES
    for k in _PEAKS
    for what in _OF_PEAK
}
KNOWN = (*STUCK_MODES, *PEAK_NUMBERS)


@dataclass(frozen=True)
class FitTarget:
    """A number that is to come out.

    Attributes
    ----------
    name : str
        Of the number, one of `KNOWN`.
    value : float
        In its unit.
    half_width : float, optional
        What stood after +-; None where nothing did.
    unit : str
        Hz or (m/s2)/N.
    """

    name: str
    value: float
    half_width: float | None
    unit: str

    @property
    def scale(self) -> float:
        """By what residuals are divided: the half-width, or the value itself."""
        return self.value if self.half_width is None else self.half_width

    @property
    def shown(self) -> str:
        """With its unit and half-width."""
        text = f"{self.value:.8g} {self.unit}"
        return text if self.half_width is None else f"{text} ± {self.half_width:.3g} {self.unit}"


def read_targets(to: str | Mapping[str, str] | Sequence[str]) -> tuple[FitTarget, ...]:
    """Targets from "name=377 Hz +- 0.5 Hz,name=440 Hz +- 0.5 Hz".

    Parameters
    ----------
    to
        One text, texts of one target each, or a mapping name -> quantity.

    Raises
    ------
    InputError
        With everything that is wrong with them.
    """
    if isinstance(to, Mapping):
        pairs = [(str(name), str(text)) for name, text in to.items()]
    else:
        parts = to.split(",") if isinstance(to, str) else [str(one) for one in to]
        split = [one.partition("=") for one in parts if one.strip()]
        pairs = [(name.strip(), text.strip()) for name, _, text in split]
    found: list[FitTarget] = []
    problems = [] if pairs else ['none given; write for example "stuck_in_phase=377 Hz"']
    for name, text in pairs:
        try:
            found.append(_target(name, text))
        except InputError as error:
            problems.append(f"{name}: {error}")
    names = [name for name, _ in pairs]
    problems += [f"{n}: given twice" for n in dict.fromkeys(names) if names.count(n) > 1]
    if len({one.half_width is None for one in found}) > 1:
        without = ", ".join(one.name for one in found if one.half_width is None)
        problems.append(
            f"{without}: no half-width, though others have one; to fix it: write +- for all "
            "targets, or for none"
        )
    if problems:
        raise InputError("targets of the fit:\n" + "\n".join(f"  {one}" for one in problems))
    return tuple(found)


def _target(name: str, text: str) -> FitTarget:
    if name not in KNOWN:
        near = difflib.get_close_matches(name, KNOWN, 2)
        raise InputError(
            "is no number that can be fitted"
            + (f"; did you mean {' or '.join(near)}?" if near else ".")
            + f" Known: {', '.join(KNOWN)}"
        )
    kind = "frequency" if name in STUCK_MODES else _OF_PEAK[PEAK_NUMBERS[name][3]]
    if not text:
        raise InputError(f'has no value; write {name}="377 {unit_inside(kind)}"')
    value, half = read_band(text, kind)
    if not value > 0.0:
        raise InputError(f"{text!r} is not above 0")
    return FitTarget(name, value, half, unit_inside(kind))
