"""Sizes of the rig's damper, in the words that recipes share."""

from __future__ import annotations

import math

from geometry.blade_rig_params import BladeRig
from geometry.blocks import DamperSizes, Size


def damper_sizes(params: BladeRig) -> DamperSizes:
    """The damper of the chosen arrangement and its contact.

    Of the asymmetric one the padded face; the vertical face has no recipe of its own.
    """
    return _wedge(params) if params.arrangement == "symmetric" else _pads(params)


def _wedge(p: BladeRig) -> DamperSizes:
    area = 0.5 * (p.damper_base + p.damper_top) * p.damper_height
    return DamperSizes(
        "wedge",
        area * p.platform_wy,
        {
            "angle of the contact face to the base": Size(p.front_angle, "deg", "front_angle"),
            "base of the damper": Size(p.damper_base, "mm", "damper_base"),
            "height of the damper": Size(p.damper_height, "mm", "damper_height"),
            "length of the damper": Size(p.platform_wy, "mm", "platform_wy"),
            "contact along the slope": Size(p.patch_length, "mm", "patch_length"),
            "contact along the damper": Size(p.patch_across, "mm", "patch_width"),
            "contact below the upper end of its leg": Size(
                p.leg_span[1] - p.patch_span[1], "mm", "patch_offset"
            ),
        },
    )


def _pads(p: BladeRig) -> DamperSizes:
    fall = math.tan(math.radians(p.rear_angle_right)) - math.tan(
        math.radians(p.damper_angle_left - 90.0)
    )
    # its ends are vertical
    area = p.damper_cut * (p.damper_left - 0.5 * p.damper_cut * fall)
    return DamperSizes(
        "pads",
        area * p.platform_wy + 2.0 * p.pad_width * p.pad_length * p.pad_step,
        {
            "angle of the padded face to the horizontal": Size(
                p.rear_angle_right, "deg", "rear_angle_right"
            ),
            "angle of vertical face and bottom": Size(
                p.damper_angle_left, "deg", "damper_angle_left"
            ),
            "height of the vertical face": Size(p.damper_left, "mm", "damper_left"),
            "extent from the vertical face": Size(p.damper_cut, "mm", "damper_cut"),
            "length of the damper": Size(p.platform_wy, "mm", "platform_wy"),
            "pad along the slope": Size(p.pad_width, "mm", "pad_width"),
            "pad along the damper": Size(p.pad_length, "mm", "platform_wy, pad_gap"),
            "gap between the pads": Size(p.pad_gap, "mm", "pad_gap"),
            "height of the pads": Size(p.pad_step, "mm", "pad_step"),
            "middle of the pads from the vertical face": Size(p.pad_centre, "mm", "pad_centre"),
            "height of one pad below the other": Size(0.0),
        },
    )
