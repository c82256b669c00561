"""What a convergence study of a bladed disk varies: the recipe's counts of elements, harmonics."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from upd.analyses.bladed_disk.plan import make_plan
from upd.errors import InputError
from upd.scene import BladedDiskScene
from upd.vary.ladder import Asked, Ladder, chosen_levels, counts
from upd.vary.solve import changed
from upd.vary.variation import Overrides, Variation

_RESPONSE: Overrides = (("want", ["response"]),)
#: shares of the scene's own counts
_SHARES = (0.35, 0.5, 0.7, 1.0)


def _meshes(scene: BladedDiskScene, asked: Asked) -> Iterator[Variation]:
    """Shares of all counts of elements; the size is the cube root of the hexahedra."""
    kinds = "layers", "columns", "axial"
    own = {name: n for name, n in scene.geometry.items() if name.endswith(kinds)}
    if not own:
        raise InputError("--vary mesh: geometry names no numbers of elements; give them")
    shares = chosen_levels(asked or _SHARES, lambda n: n > 0.0, "shares of the elements, above 0")
    for share in shares:
        # an overhang has two columns at least
        given = (
            (f"geometry.{name}", max(1 + ("over" in name), round(share * n)))
            for name, n in own.items()
        )
        overrides: Overrides = (("want", ["modes"]), *given)
        plans = make_plan(scene), make_plan(changed(scene, overrides))
        hexes = [sum(body["hexes"] for body in one.size.values()) for one in plans]
        size = (hexes[0] / hexes[1]) ** (1.0 / 3.0)
        yield Variation("mesh", f"{share:g} of the elements along edges", overrides, size)


LADDERS: Mapping[str, Ladder] = {
    "mesh": Ladder(_meshes),
    "harmonics": Ladder(
        counts("harmonics", "{} harmonics", "response.harmonics", (1, 3, 5), 1, _RESPONSE)
    ),
}
