"""What a run costs: one model of seconds and bytes, added up piece by piece.

Every piece is work that can be counted before it is done (entries and operations of a factor, right
sides, dense algebra, Newton steps times points) over the rates of a usual machine
(`upd.linalg.select`). The work of a piece was counted or timed on the ready scenes with one
thread.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from upd.errors import InputError
from upd.linalg import select
from upd.linalg.select import Prediction, Solid, choose_route, contact_routes
from upd.scene import AnyScene

#: element -> nodes per hexahedron
NODES = {"hex8": 8, "hex8i": 8, "hex20": 20, "hex20r": 20, "hex27": 27}
#: numbers of "nodes", "hexes" and "contact" nodes of a body
Count = Mapping[str, int]

# A hexahedron's K, and K with M, as times that of hex8's K, with the checks of its mesh.
_K = {"hex8": 2.0, "hex8i": 4.0, "hex20": 12.0, "hex20r": 10.0, "hex27": 22.0}
_K_AND_M = {"hex8": 6.0, "hex8i": 9.0, "hex20": 18.0, "hex20r": 16.0, "hex27": 36.0}
# Bytes per entry of K: of its upper triangle as a body keeps it, and of that of the free dofs with
# the columns that PARDISO reads.
_ENTRY, _COPIES = 6.0, 10.0
#: memory of the libraries, and of figures and pages
START_BYTES = 2.5e8


def dense_s(flops: float) -> float:
    """Seconds of dense algebra."""
    return flops / select.DENSE_FLOPS


def memory_limit(scene: AnyScene) -> float:
    """Bytes that a run of the scene may take."""
    return float(scene.solver.memory or select.memory_left())


@dataclass
class CostModel:
    """Predicted seconds and bytes of a run, added up piece by piece, and the linear solver of every
    task.
    """

    scene: AnyScene
    size: Mapping[str, Count] = field(default_factory=dict)
    seconds: float = 0.0
    solver: dict[str, str] = field(default_factory=dict)
    kept_bytes: float = START_BYTES
    #: bytes that another run takes before
    before_bytes: float = 0.0
    #: bytes of jobs of which several may run side by side
    jobs: list[float] = field(default_factory=list)
    #: of condensed bodies, by their place among the jobs: bytes that stay when their factor goes
    left: dict[int, float] = field(default_factory=dict)
    #: seconds of such jobs
    shared: float = 0.0

    @property
    def nodes(self) -> int:
        """Of all bodies."""
        return sum(count["nodes"] for count in self.size.values())

    def solid(self, count: Count) -> Solid:
        """Shape of a body of the scene."""
        return Solid.of(count["hexes"], count["nodes"], NODES[self.scene.mesh.element])

    def _entries(self, count: Count) -> float:
        """Of a body's K."""
        return 3.0 * count["nodes"] * self.solid(count).entries

    def contact_body(self, count: Count) -> None:
        """A body meshed, with its K."""
        self.seconds += 0.2 + count["hexes"] * _K[self.scene.mesh.element] / select.ELEMENTS
        self.kept_bytes += self._entries(count) * _ENTRY

    def dynamic_body(self, count: Count, times: float = 1.0) -> None:
        """A body with its K and M."""
        elements = count["hexes"] * _K_AND_M[self.scene.mesh.element]
        self.seconds += times * (0.1 + elements / select.ELEMENTS)
        # M has no entries between components.
        self.kept_bytes += self._entries(count) * _ENTRY * 4.0 / 3.0

    def choice(self, task: str, count: Count, n_kept: int, *, direct: bool = False) -> Prediction:
        """The solver of a task, "body, what", and its cost; ``direct``: one that factorises."""
        asked, n_dof, solid = self.scene.solver, 3 * count["nodes"], self.solid(count)
        if asked.route == "products":
            raise InputError(
                "solver.route: products serve the contact of two curved bodies, held node by node, "
                'whose normal and tangential problems are apart; use "auto" or "condensed"'
            )
        choice = select.choose(
            n_dof,
            n_kept,
            solver=asked.name,
            memory_limit_bytes=asked.memory,
            direct=direct,
            solid=solid,
        )
        self.solver[task] = f"{choice.name}: {choice.why}"
        return choice.cost

    def condensed(
        self, task: str, count: Count, n_kept: int, found: Prediction | None = None
    ) -> None:
        """A body condensed onto its contact dofs, by a solver chosen before or by the best.

        The next job lets its factor go: K of the free dofs and what is dense stay. Multigrid and
        what is learned from products keep their solver.
        """
        found = found or self.choice(task, count, n_kept)
        self.shared += found.seconds
        if not self.solver[task].startswith(("amg", select.PRODUCTS)):
            dense = select.DENSE * float(n_kept) ** 2
            self.left[len(self.jobs)] = dense + self._entries(count) * _ENTRY
        self.jobs.append(found.bytes + self._entries(count) * _COPIES)

    def contact(self, task: str, count: Count, n_kept: int, products: int, room: float) -> None:
        """A body condensed onto its contact dofs, or seen by so many products, in ``room`` bytes
        where a way fits.
        """
        asked = self.scene.solver
        ways = contact_routes(
            3 * count["nodes"],
            n_kept,
            products,
            solver=asked.name,
            memory_limit_bytes=asked.memory,
            solid=self.solid(count),
        )
        rest = room - self._entries(count) * _COPIES
        choice = choose_route(ways, products, route=asked.route, memory_limit_bytes=rest)
        self.solver[task] = f"{choice.name}: {choice.why}"
        self.condensed(task, count, n_kept, choice.cost)

    def held_in_mean(self, task: str, count: Count) -> None:
        """What a body that was condensed takes more where a weighted set holds it: another factor,
        for the displacements under six tractions over the set.
        """
        name = self.solver[task].partition(":")[0]
        found = select.predict(3 * count["nodes"], 0, name, self.solid(count))
        again = found.seconds if name == "amg" else found.substitution()
        self.shared += found.seconds + 5.0 * again

    def modes(self, task: str, count: Count, times: int = 1) -> None:
        """``times`` the lowest modes of a body: its factor, Lanczos with about sixty right sides,
        and another factor that counts the modes.
        """
        found = self.choice(task, count, 0, direct=True)
        # The second matrix is ordered again, but checked no more.
        one = 0.15 + 1.5 * found.seconds + 1.5 * found.factor_seconds
        one += 30.0 * found.substitution()
        self.shared += times * one
        self.jobs += times * [2.0 * found.bytes + self._entries(count) * _COPIES]

    def reduction(self, task: str, count: Count, n_kept: int, modes: int) -> None:
        """A body reduced to its kept dofs and some of its modes: its Schur complement, a right side
        per kept dof, modes with these held.
        """
        found, nodes = self.choice(task, count, n_kept, direct=True), count["nodes"]
        columns = 0.5 * n_kept * found.substitution()
        columns += dense_s(2.0 * 3.0 * nodes * float(n_kept) ** 2)
        lanczos = 0.15 + 1.5 * found.seconds + _lanczos(modes) * found.substitution()
        self.shared += found.seconds + columns + lanczos
        dense = 3.0 * 24.0 * nodes * n_kept
        self.jobs.append(3.0 * found.bytes + dense + 2.0 * self._entries(count) * _COPIES)

    def attached(self, task: str, count: Count, loads: int, modes: int) -> None:
        """A body reduced to its lowest modes and its displacements under loads: the factor of both,
        in its place another that counts the modes, a right side per load.
        """
        found, nodes = self.choice(task, count, 0, direct=True), count["nodes"]
        columns = 0.5 * loads * found.substitution()
        columns += dense_s(4.0 * 3.0 * nodes * float(loads) ** 2)
        columns += _lanczos(modes) * found.substitution()
        self.shared += 0.15 + 3.0 * found.seconds + columns
        dense = 4.0 * 24.0 * nodes * loads
        self.jobs.append(found.bytes + dense + 2.0 * self._entries(count) * _COPIES)

    @property
    def threads(self) -> int:
        """Tasks that may run side by side.

        SuperLU and multigrid change process-wide warning filters while they run, one at a time.
        """
        return (
            select.threads()
            if all(why.startswith("pardiso") for why in self.solver.values())
            else 1
        )

    def in_a_row(self, *, keep: bool) -> tuple[float, int]:
        """Bytes of jobs that end one after another, and how many of them may run side by side.

        Parameters
        ----------
        keep
            Whether all stays of every job, or the factors of condensed bodies go.
        """
        left = [one if keep else self.left.get(i, one) for i, one in enumerate(self.jobs)]
        more = sorted((a - b for a, b in zip(self.jobs, left, strict=True)), reverse=True)
        many = min(self.threads, len(self.jobs))
        while many > 1 and self.kept_bytes + sum(left) + sum(more[:many]) > memory_limit(
            self.scene
        ):
            many -= 1
        return self.kept_bytes + sum(left) + sum(more[:many]), many

    def side_by_side(self, workers: int, jobs: int) -> tuple[float, int]:
        """Bytes when so many of ``jobs`` tasks run at the same time, and how many: ``workers``, or
        fewer where these do not fit.
        """
        each = max(self.jobs, default=0.0)
        while workers > 1 and self.kept_bytes + min(workers, jobs) * each > memory_limit(
            self.scene
        ):
            workers -= 1
        return max(self.before_bytes, self.kept_bytes + min(workers, jobs) * each), workers

    def total(self, workers: int) -> float:
        """Seconds by the clock, with so many workers on the jobs that may run side by side."""
        # Alone, a factorisation itself takes all threads; the gain is about the same.
        many = max(workers, 1) if workers > 1 else 2
        gain = select.SPEEDUP if min(many, select.threads_used()) > 1 else 1.0
        return self.seconds + self.shared / gain


def _lanczos(modes: int) -> float:
    """Substitutions of pairs of right sides for so many modes (counted with 5 to 40 of them)."""
    return 14.0 + 1.6 * modes
