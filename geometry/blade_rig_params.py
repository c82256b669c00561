"""Parameters of the two-blade rig, the lengths that follow from them, and their checks."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Literal

from geometry.blocks import choice, field_faults, in_degrees, in_mm, ratio, require, whole

#: share of a patch's length that its smallest neighbour must keep
_LEAST_MARGIN = 0.01


@dataclass(frozen=True)
class BladeRig:
    """The two blades on their bases, with or without the damper.

    Axes: x across the blades, y along the damper, z up; the bases end at z = 0, the blade axes
    are at x = -pitch/2 and pitch/2. Blade: shank, platform, core. The platform has a front side
    with an inclined underside and a rear side: vertical on the left blade, inclined on the right
    one. The damper is as long as the platform is wide. The numbers of elements are those at refine
    = 1.

    Parameters
    ----------
    pitch : float
        Between the blade axes, mm.
    front_halfwidth, rear_halfwidth : float
        From a blade's axis to the tip of its front and rear side, mm.
    front_angle : float
        Of the front underside to the horizontal, degrees.
    rear_angle_right : float
        Of the right blade's rear underside to the horizontal, degrees.
    base_x, base_y, base_height : float
        Edges of a base along x, y and z, mm.
    shank_length : float
        Height of the shank, from the base to the platform, mm.
    shank_tx, shank_wy : float
        Thickness along x and width along y of the shank, mm.
    platform_height, platform_wy : float
        Height and width along y of the platform, mm.
    core_length : float
        Height of the core above the platform, mm.
    core_tx, core_wy : float
        Thickness along x and width along y of the core, mm.
    accelerometer_depth : float
        Below the blade's top, mm.
    damper_base, damper_height : float
        Symmetric damper, a trapezoid whose legs lie on the undersides, mm.
    patch_length, patch_offset : float
        Symmetric contact along the slope, and where it starts below the tip, mm.
    patch_width : float, optional
        The same along y, about the middle, mm; None: as wide as the platform.
    damper_left, damper_cut : float
        Asymmetric damper: height of its vertical left face and extent in x, mm.
    damper_angle_left : float
        Angle of left face and bottom, degrees.
    pad_width, pad_gap : float
        Of the two pads: width along the slope, and the gap between them, mm.
    pad_step : float
        Their height, mm.
    pad_centre : float
        Their centre in x from the left face, mm.
    arrangement : {"symmetric", "asymmetric"}
        "symmetric" turns the fronts to each other, "asymmetric" the rears.
    damper : {"none", "free", "glued"}
        "free", a third body with the same patch nodes; "glued", one body with merged patch nodes.
    clamped : {"y_faces", "x_faces", "bottom"}
        Sides of the bases that are held; "y_faces" are y = +-base_y/2.
    symmetry : {"full", "half"}
        "half" is y >= 0. Cost: half the dofs.
    element_nodes : {8, 20, 27}
        Nodes per hexahedron. Cost: 20 and 27 take four to eight times the dofs of 8.
    refine : float
        Multiplies every number of elements; sizes keep their distribution. 0.5 is a coarser mesh:
        counts that are not whole are rounded, see `rounded`. Cost: elements grow with its cube.
    growth : float
        Ratio of neighbouring element sizes away from re-entrant corners and the clamped edge.
    growth_inside : float
        The same from both sides of shank, core and platform to their middles, through the thickness
        and over the height.
    across : int
        Elements through the thickness of shank and core. Cost: dofs of the blades grow in
        proportion.
    base_columns, base_side : int
        Elements from the shank to the base's sides: along x, and per half of the way along y.
    base_layers : int
        Elements over the base's height.
    shank_layers : int
        Elements per half shank.
    platform_layers : int
        Elements over the platform's height.
    core_layers, core_upper : int
        Elements from platform to force point, and from there to the accelerometer.
    wing_columns : int
        Elements on a platform side without contact.
    patch_along_y, patch_along_slope : int
        Elements on the symmetric contact patch; along y an even number. Cost: contact nodes grow in
        proportion, the reduction faster.
    pad_along_y, pad_along_slope : int
        Elements on a pad. Cost: contact nodes grow in proportion, the reduction faster.
    face_along_z : int
        Elements up the contact of the asymmetric damper's left face. Cost: contact nodes grow in
        proportion.
    damper_columns : int
        Elements across the symmetric damper.

    Raises
    ------
    InputError
        With all errors, one per line.
    """

    pitch: float = in_mm(50.0)
    front_halfwidth: float = in_mm(22.0)
    rear_halfwidth: float = in_mm(23.5)
    front_angle: float = in_degrees(45.0, most=60.0)
    rear_angle_right: float = in_degrees(30.0, most=60.0)
    base_x: float = in_mm(50.0)
    base_y: float = in_mm(80.0)
    base_height: float = in_mm(40.0)
    shank_length: float = in_mm(63.3)
    shank_tx: float = in_mm(15.6)
    shank_wy: float = in_mm(42.5)
    platform_height: float = in_mm(18.0)
    platform_wy: float = in_mm(42.5)
    core_length: float = in_mm(135.1)
    core_tx: float = in_mm(11.38)
    core_wy: float = in_mm(36.3)
    accelerometer_depth: float = in_mm(5.0)
    damper_base: float = in_mm(30.0)
    damper_height: float = in_mm(12.0)
    patch_length: float = in_mm(15.0)
    patch_offset: float = in_mm(1.5)
    patch_width: float | None = in_mm(None)
    damper_left: float = in_mm(12.0)
    damper_cut: float = in_mm(17.5)
    damper_angle_left: float = in_degrees(95.0)
    pad_width: float = in_mm(8.0)
    pad_gap: float = in_mm(6.5)
    pad_step: float = in_mm(1.0)
    pad_centre: float = in_mm(7.129)
    arrangement: Literal["symmetric", "asymmetric"] = choice("symmetric", "symmetric", "asymmetric")
    damper: Literal["none", "free", "glued"] = choice("none", "none", "free", "glued")
    clamped: Literal["y_faces", "x_faces", "bottom"] = choice(
        "y_faces", "y_faces", "x_faces", "bottom"
    )
    symmetry: Literal["full", "half"] = choice("full", "full", "half")
    element_nodes: int = choice(20, 8, 20, 27)
    refine: float = ratio(1.0, 0.5)
    growth: float = ratio(1.6, 1.0, 3.0)
    growth_inside: float = ratio(1.0, 1.0, 3.0)
    across: int = whole(2)
    base_columns: int = whole(3)
    base_side: int = whole(2)
    base_layers: int = whole(4)
    shank_layers: int = whole(3)
    platform_layers: int = whole(3)
    core_layers: int = whole(4)
    core_upper: int = whole(3)
    wing_columns: int = whole(3)
    patch_along_y: int = whole(
        10, 4, even=True, why="the plane y = 0 and the core's side need lines"
    )
    patch_along_slope: int = whole(4)
    pad_along_y: int = whole(6, 2, why="the core's side needs a line")
    pad_along_slope: int = whole(3)
    face_along_z: int = whole(3)
    damper_columns: int = whole(6)

    def __post_init__(self) -> None:
        require(field_faults(self))
        require(_misfits(self))

    @property
    def gap_front(self) -> float:
        """Gap between the two front tips, mm (symmetric arrangement)."""
        return self.pitch - 2.0 * self.front_halfwidth

    @property
    def gap_rear(self) -> float:
        """Gap between the two rear tips, mm (asymmetric arrangement)."""
        return self.pitch - 2.0 * self.rear_halfwidth

    @property
    def platform_top(self) -> float:
        """z of the platform's upper side, mm."""
        return self.shank_length + self.platform_height

    @property
    def top(self) -> float:
        """z of the blade's end, mm."""
        return self.platform_top + self.core_length

    @property
    def damper_top(self) -> float:
        """Width of the symmetric damper's upper side, mm."""
        return self.damper_base - 2.0 * self.damper_height / math.tan(
            math.radians(self.front_angle)
        )

    @property
    def pad_length(self) -> float:
        """Extent of one pad along y, mm."""
        return (self.platform_wy - self.pad_gap) / 2.0

    def underside(self, front: bool) -> float:
        """Length of an inclined underside along its slope, mm.

        Of the front side, or of the right blade's rear side.
        """
        halfwidth, angle = (
            (self.front_halfwidth, self.front_angle)
            if front
            else (self.rear_halfwidth, self.rear_angle_right)
        )
        return (halfwidth - self.shank_tx / 2.0) / math.cos(math.radians(angle))

    @property
    def patch_across(self) -> float:
        """Width of the symmetric contact along y, mm."""
        return self.platform_wy if self.patch_width is None else self.patch_width

    @property
    def patch_span(self) -> tuple[float, float]:
        """Start and end of the inclined contact, mm along the underside from the shank.

        The patch, or the pads on the right blade.
        """
        if self.arrangement == "symmetric":
            end = self.underside(True) - self.patch_offset
            return end - self.patch_length, end
        centre = self.pitch - self.rear_halfwidth - self.shank_tx / 2.0 - self.pad_centre
        along = centre / math.cos(math.radians(self.rear_angle_right))
        return along - self.pad_width / 2.0, along + self.pad_width / 2.0

    @property
    def leg_span(self) -> tuple[float, float]:
        """The symmetric damper's leg, mm along the underside from the shank."""
        angle = math.radians(self.front_angle)
        start = (self.pitch - self.shank_tx - self.damper_base) / 2.0 / math.cos(angle)
        return start, start + self.damper_height / math.sin(angle)

    @property
    def left_face(self) -> tuple[float, float]:
        """z of the lower and upper end of the asymmetric damper's left face, mm."""
        angle = math.radians(self.rear_angle_right)
        reach = self.pitch - self.rear_halfwidth - self.shank_tx / 2.0
        upper = self.shank_length + reach * math.tan(angle) - self.pad_step / math.cos(angle)
        return upper - self.damper_left, upper


#: numbers of elements that refine multiplies
_COUNTS = (
    *("across", "base_columns", "base_side", "base_layers", "shank_layers", "platform_layers"),
    *("core_layers", "core_upper", "wing_columns", "patch_along_y", "patch_along_slope"),
    *("pad_along_y", "pad_along_slope", "face_along_z", "damper_columns"),
)


def rounded(p: BladeRig) -> BladeRig:
    """The same rig with a whole ``refine``: the next one above, of a mesh coarser by the rest.

    Numbers of elements are rounded to those their own bounds allow, even ones to even ones; growth
    of sizes is that over as many more elements.
    """
    whole_part = math.ceil(p.refine)
    share = p.refine / whole_part
    if share == 1.0:
        return p
    bounds = {f.name: f.metadata["bounds"] for f in fields(p) if "bounds" in f.metadata}
    counts = {}
    for name in _COUNTS:
        step = 2 if bounds[name].even else 1
        count = step * round(share * getattr(p, name) / step)
        counts[name] = max(int(bounds[name].least), count)
    growths = {
        name: min(getattr(p, name) ** (1.0 / share), bounds[name].most)
        for name in ("growth", "growth_inside")
    }
    return replace(p, **counts, **growths, refine=whole_part)


def _misfits(p: BladeRig) -> list[str]:
    """Errors of the dimensions against each other."""
    return _blade_misfits(p) or (
        _symmetric_misfits(p) if p.arrangement == "symmetric" else _asymmetric_misfits(p)
    )


def _failed(checks: list[tuple[bool, str]]) -> list[str]:
    return [message for ok, message in checks if not ok]


def _blade_misfits(p: BladeRig) -> list[str]:
    steepest = [
        ("front_angle", p.front_angle, p.front_halfwidth),
        ("rear_angle_right", p.rear_angle_right, p.rear_halfwidth),
    ]
    checks = [
        (
            max(p.shank_tx, p.core_tx) < 2.0 * side,
            f"{name}: {side:g} mm does not reach beyond shank and core",
        )
        for name, side in (
            ("front_halfwidth", p.front_halfwidth),
            ("rear_halfwidth", p.rear_halfwidth),
            ("base_x", p.base_x / 2.0),
        )
    ]
    for name, angle, halfwidth in steepest:
        rise = (halfwidth - p.shank_tx / 2.0) * math.tan(math.radians(angle))
        checks.append(
            (
                rise < 0.95 * p.platform_height,
                f"{name}: the underside rises {rise:g} mm, the platform is "
                f"{p.platform_height:g} high",
            )
        )
    widest = max(p.shank_wy, p.platform_wy)
    gap = p.gap_front if p.arrangement == "symmetric" else p.gap_rear
    checks += [
        (
            p.base_y > widest,
            f"base_y: {p.base_y:g} mm; must be more than shank and platform, {widest:g} mm",
        ),
        (
            p.core_wy <= p.platform_wy,
            f"core_wy: {p.core_wy:g} mm; at most the platform's {p.platform_wy:g} mm",
        ),
        (
            min(p.core_wy, p.shank_wy) > p.platform_wy / 2.0,
            f"core_wy, shank_wy: must be more than half the platform's {p.platform_wy:g} mm",
        ),
        (p.pitch >= p.base_x, f"pitch: {p.pitch:g} mm; the bases of {p.base_x:g} mm overlap"),
        (gap > 0.0, f"pitch: {p.pitch:g} mm; the platforms overlap by {-gap:g} mm"),
        (
            p.accelerometer_depth < p.core_length / 2.0,
            f"accelerometer_depth: {p.accelerometer_depth:g} mm; must stay above the force "
            f"point, at most {p.core_length / 2.0:g}",
        ),
    ]
    return _failed(checks)


def _symmetric_misfits(p: BladeRig) -> list[str]:
    start, end = p.patch_span
    low, high = p.leg_span
    margin = _LEAST_MARGIN * p.patch_length
    wide = _widest_core(p, start - margin, p.front_angle)
    room = f"the leg spans {low:g} ... {high:g} mm of the underside's {p.underside(True):g} mm"
    whole = p.patch_across == p.platform_wy
    beside = (p.platform_wy - p.patch_across) / 2.0
    thin = _LEAST_MARGIN * p.platform_wy
    return _failed(
        [
            (
                whole or beside >= thin,
                f"patch_width: {p.patch_across:g} mm leaves no row of elements beside the patch; "
                f"at most {p.platform_wy - 2.0 * thin:g} mm, or the platform's {p.platform_wy:g} "
                "mm",
            ),
            (
                whole or p.damper != "glued",
                f"patch_width: {p.patch_across:g} mm; a glued damper is joined over its whole "
                "length, remove patch_width",
            ),
            (
                p.patch_offset >= margin,
                f"patch_offset: {p.patch_offset:g} mm; at least {margin:g} mm",
            ),
            (
                start >= margin,
                f"patch_length: the patch starts {start:g} mm from the shank; at least "
                f"{margin:g} mm",
            ),
            (
                start < margin or p.core_tx <= wide,
                f"core_tx: {p.core_tx:g} mm reaches over the start of the patch; at most "
                f"{wide:g} mm, or shorten the patch",
            ),
            (
                p.damper == "none" or p.damper_top > 0.0,
                f"damper_height: the legs cross, upper side {p.damper_top:g} mm; lower it",
            ),
            (
                p.damper == "none" or low >= 0.0,
                f"damper_base: {p.damper_base:g} mm touches the shanks; at most "
                f"{p.pitch - p.shank_tx:g}",
            ),
            (
                p.damper == "none" or start - low >= margin,
                f"patch_length: the patch starts at {start:g} mm, {room}; shorten the "
                "patch or widen damper_base",
            ),
            (
                p.damper == "none" or high - end >= margin,
                f"damper_height: the patch ends at {end:g} mm, {room}; raise the damper",
            ),
        ]
    )


def _asymmetric_misfits(p: BladeRig) -> list[str]:
    start, end = p.patch_span
    low, high = p.left_face
    margin = _LEAST_MARGIN * p.pad_width
    length, half = (
        p.underside(False),
        p.pad_width / 2.0 * math.cos(math.radians(p.rear_angle_right)),
    )
    overlap = min(high, p.platform_top) - p.shank_length
    wide = _widest_core(p, start - margin, p.rear_angle_right)
    return _failed(
        [
            (
                p.pad_gap < p.core_wy,
                f"pad_gap: {p.pad_gap:g} mm; must be less than core_wy, {p.core_wy:g} mm",
            ),
            (
                start >= margin,
                f"pad_centre: the pads start {start:g} mm from the shank; at least "
                f"{margin:g} mm, move them to the left",
            ),
            (
                start < margin or p.core_tx <= wide,
                f"core_tx: {p.core_tx:g} mm reaches over the start of the pads; at most "
                f"{wide:g} mm, or move them to the left",
            ),
            (
                length - end >= margin,
                f"pad_centre: the pads end {length - end:g} mm from the tip; at least "
                f"{margin:g} mm, move them to the right",
            ),
            (
                overlap >= margin and high < p.platform_top,
                f"pad_step: the left face ends at z = {high:g} mm, not on the left platform",
            ),
            (
                p.damper == "none" or low < p.shank_length,
                f"damper_left: must reach below the platform, at least {overlap:g} mm",
            ),
            (
                p.damper == "none" or p.pad_centre + half < p.damper_cut,
                f"damper_cut: {p.damper_cut:g} mm ends before the pads, at "
                f"{p.pad_centre + half:g} mm",
            ),
            (
                p.damper == "none"
                or p.pad_centre - half > p.pad_step * math.sin(math.radians(p.rear_angle_right)),
                "pad_centre: the pads reach beyond the left face; at least "
                f"{half + p.pad_step:g} mm",
            ),
            (
                p.damper == "none" or 90.0 <= p.damper_angle_left < 120.0,
                f"damper_angle_left: {p.damper_angle_left:g} degrees are outside 90 ... 120",
            ),
            (
                p.damper == "none" or _right_edge(p) > margin,
                "damper_cut: nothing of the right edge remains; shorten it or lengthen damper_left",
            ),
        ]
    )


def _widest_core(p: BladeRig, along: float, angle: float) -> float:
    """Thickness of a core whose side stands above a point of an underside, mm.

    The point lies ``along`` mm up the underside from the shank; the mesh lines of the contact go
    straight up from there.
    """
    return p.shank_tx + 2.0 * along * math.cos(math.radians(angle))


def _right_edge(p: BladeRig) -> float:
    """Height of the asymmetric damper where it is cut, mm."""
    fall = math.tan(math.radians(p.rear_angle_right)) - math.tan(
        math.radians(p.damper_angle_left - 90.0)
    )
    return p.damper_left - p.damper_cut * fall
