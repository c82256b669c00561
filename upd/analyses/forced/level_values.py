"""Numbers of a response on other levels, as they are kept with its solution."""

from __future__ import annotations

from dataclasses import dataclass, field

from upd.analyses.base import Resolved
from upd.results import Case

#: name and case of a number
Key = tuple[str, Case]


@dataclass(frozen=True)
class LevelValue:
    """A number on another level.

    Attributes
    ----------
    source, ladder
        Of the error; the ladder of levels it belongs to, of which a source may have several.
    label
        The level in words.
    size
        Of the level over that of the run: above 1 coarser, below 1 finer.
    ratio
        The number over that of the run; NaN where it was not found.
    seconds
        Of the processor that it took.
    order
        Of the ladder, known or assumed.
    times
        How many times as long as the run's own level it took, where that was solved alike.
    """

    source: str
    ladder: str
    label: str
    size: float
    ratio: float
    seconds: float
    order: float = 1.0
    times: float | None = None


@dataclass(frozen=True)
class Untold:
    """What a source adds to a number where no level tells it: an error that is known, or NaN, and
    why.
    """

    source: str
    error: float
    why: str


@dataclass
class ForcedLevels:
    """All that was solved again for the errors of a run.

    Attributes
    ----------
    values, told
        Number -> its levels; what is known without.
    curve_seconds
        Number -> seconds of its curve or sweeps.
    checked
        What the run's checks of harmonics, samples and modes show.
    """

    values: dict[Key, list[LevelValue]] = field(default_factory=dict)
    told: dict[Key, list[Untold]] = field(default_factory=dict)
    curve_seconds: dict[Key, float] = field(default_factory=dict)
    checked: list[Resolved] = field(default_factory=list)

    def add(self, key: Key, value: LevelValue) -> None:
        """One more level of a number."""
        self.values.setdefault(key, []).append(value)

    def tell(self, key: Key, source: str, error: float, why: str) -> None:
        """What a source adds to a number without a level."""
        self.told.setdefault(key, []).append(Untold(source, error, why))
