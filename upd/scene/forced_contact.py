"""The contact of a forced response: friction and points, static state, stiffness of the faces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator

from upd.errors import InputError
from upd.scene import quantities as q
from upd.scene.base import FaceFriction, Fit
from upd.units import parse_quantity

Stiffness = Annotated[float, q.quantity("stiffness"), q.positive, q.Example('"1e6 N/mm"')]
Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")
#: contact.rule of points by polynomials
GAUSS: Final = "gauss"
#: named static states before vibration
STATES = ("seated", *q.EQUILIBRIA)


def _static(value: Any) -> Any:
    if isinstance(value, str) and value in STATES:
        return value
    if not isinstance(value, Mapping) or set(value) != set(SIDES):
        known = ", ".join(f'"{name}"' for name in STATES)
        raise ValueError(
            f"{value!r} is no static state; write one of {known}, the ratios T/N of both faces, "
            "{ left = 0.2, right = 0.2 }, or their forces, "
            '{ left = { N = "200 N", T = "10 N" }, right = { N = "200 N", T = "10 N" } }'
        )
    return {side: _static_face(side, value[side]) for side in SIDES}


def _static_face(side: str, value: Any) -> Any:
    """A face's ratio T/N, or its forces N and T."""
    forces = isinstance(value, Mapping)
    if forces and set(value) != {"N", "T"}:
        raise ValueError(f'{side}: {value!r}: write {{ N = "200 N", T = "10 N" }}')
    try:
        if forces:
            return {letter: float(parse_quantity(value[letter], "force")) for letter in "NT"}
        return float(parse_quantity(value, "fraction"))
    except InputError as error:
        raise ValueError(f"{side}: {error}") from None


#: The static state before vibration: its name, ratios T/N or forces of both faces.
Static = Annotated[
    Any,
    BeforeValidator(_static),
    q.Example(
        '"frictionless"',
        bounds=f"{', '.join(STATES)}, or T/N or N and T of the left and the right face",
    ),
]


def _lines(value: Any) -> Any:
    """All lines, a number of groups, or numbers of lines, rising."""
    if value == "all" or (q.is_whole(value) and value >= 1):
        return value
    if (
        isinstance(value, (list, tuple))
        and value
        and all(q.is_whole(v) and v >= 0 for v in value)
        and len(set(value)) == len(value)
    ):
        return tuple(sorted(value))
    raise ValueError(
        f'{value!r} chooses no lattice lines; write "all", a number of groups of lines, or '
        "a list of line numbers from 0"
    )


#: Lattice lines of a contact patch: "all", a number of groups of neighbours, or their numbers from
#: 0.
Lines = Annotated[
    Any,
    BeforeValidator(_lines),
    q.Example('"all"', bounds="all, a number of groups, or a list of line numbers from 0"),
]


@dataclass(frozen=True)
class FaceLines:
    """Lattice lines of one face that replace those of the scene.

    Attributes
    ----------
    rows, columns
        As in [contact], for this face; those of [contact] when None.
    """

    rows: Lines = None
    columns: Lines = None


@dataclass(frozen=True, kw_only=True)
class FrictionChoice(FaceFriction):
    """Coulomb friction and the contact points.

    Attributes
    ----------
    model
        "springs": a rigid damper on contact points with stiffnesses; "interface": elastic blades
        and damper, every matching node of both faces, no stiffness of contact (mesh.element =
        "hex8i"). Cost: "interface" takes seconds to minutes a curve, more with finer patches.
    rows
        Lattice lines of each patch up the slope, 0 the lowest: "all", a list of lines, or a number
        of groups of neighbouring lines over whose nodes a point takes the mean. Cost: a contact
        point per row and column, seconds of a curve grow at least in proportion.
    columns
        The same along the damper. Cost: as of rows.
    rule
        What rows and columns are: "lines" of the lattice, or so many "gauss" points up the slope
        and along the damper (on both sides of its middle together), whose motion is the face's by
        polynomials and does not depend on the mesh: a few carry tension and tilt exactly. Cost: as
        of rows, and far fewer are needed.
    left, right
        Where the faces differ.
    fit
        How well the faces fit each other: "worn" or "loaded", worn in under F_C (even pressure, no
        traction, motion counts from there), or "new" or "unloaded": F_C then spreads the blades and
        wedges the damper, and rows of points may open; of whole faces also a number, 0 new to 1
        worn.
    static
        State before vibration, with fit = "loaded": "seated", F_C raised from zero on both faces
        with friction (coupled contact); "frictionless"; "opposing" or "reversed", friction fully
        mobilised against F_C or with it; ratios T/N of both faces, { left = 0.2, right = 0.2 }; or
        their forces, { left = { N = ..., T = ... }, right = ... }, in balance with F_C. T is up the
        slope on the blade, positive when it opposes F_C. Cost: "seated" a contact solution, once.
    directions
        In which friction resists sliding: "two", "one" (up the slope), or "auto": one where the
        other changes the stuck frequencies by less than 0.1 %. Cost: "two" doubles the unknowns of
        sliding.
    share
        Of a point in its face's stiffness: by tributary "area", or "equal" for every lattice node.
    stiffness
        Names of the [stiffness.NAME] tables to run, all when empty. Cost: each is a set of
        curves of its own.
    """

    model: Literal["springs", "interface"] = "springs"
    rows: Lines = "all"
    columns: Lines = "all"
    rule: Literal["lines", "gauss"] = "lines"
    left: FaceLines = field(default_factory=FaceLines)
    right: FaceLines = field(default_factory=FaceLines)
    fit: Fit = "loaded"
    static: Static = "frictionless"
    directions: Literal["auto", "one", "two"] = "auto"
    share: Literal["area", "equal"] = "area"
    stiffness: tuple[Annotated[str, q.Example('"thesis"')], ...] = ()

    @property
    def loaded(self) -> bool:
        """Whether the faces fit under F_C."""
        return self.worn == 1.0

    def lines(self, side: Literal["left", "right"]) -> tuple[Any, Any]:
        """Rows and columns of one face."""
        own = self.left if side == "left" else self.right
        return (
            self.rows if own.rows is None else own.rows,
            self.columns if own.columns is None else own.columns,
        )


@dataclass(frozen=True)
class FaceStiffness:
    """Contact stiffness of one face.

    Attributes
    ----------
    K_N, K_T
        Normal and tangential, total of the face.
    """

    K_N: Stiffness
    K_T: Stiffness


@dataclass(frozen=True)
class StiffnessChoice:
    """Contact stiffness of both faces: totals, or from a contact analysis.

    Attributes
    ----------
    K_N, K_T
        Normal and tangential total per face, shared by tributary area over the chosen points.
    left, right
        Where the faces differ.
    scene
        A ready contact scene or .toml file, run in this process; its first contact law counts.
        Cost: that of the contact scene, once.
    run
        Folder of a run of a contact scene, instead of the scene.
    points
        "lattice": the totals of that law on the chosen points.
    bodies
        "upper": the damper's elasticity alone, the blades have their own; "both": that of the
        contact run (scene only).
    """

    K_N: Stiffness | None = None
    K_T: Stiffness | None = None
    left: FaceStiffness | None = None
    right: FaceStiffness | None = None
    scene: str | None = None
    run: str | None = None
    points: Literal["lattice"] = "lattice"
    bodies: Literal["both", "upper"] = "upper"

    @property
    def from_contact(self) -> bool:
        """Whether a contact analysis gives it."""
        return self.scene is not None or self.run is not None

    def face(self, side: Literal["left", "right"]) -> FaceStiffness | None:
        """The totals given for one face, if any."""
        own = self.left if side == "left" else self.right
        if own is not None:
            return own
        return (
            FaceStiffness(self.K_N, self.K_T)
            if self.K_N is not None and self.K_T is not None
            else None
        )
