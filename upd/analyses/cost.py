"""What a run costs: one model of seconds and bytes, added up piece by piece.

Every piece is work that can be counted before it is done (entries and operations of a factor, right
sides, dense algebra, Newton steps times points) over the rates of a usual machine
(`upd.linalg.select.Rates`). The work of a piece was counted or timed on the ready scenes with one
thread.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from upd.errors import InputError
from upd.linalg import select
from upd.linalg.routes import choose_route, contact_routes
from upd.linalg.select import USUAL, Prediction, Solid
from upd.scene import AnyScene

#: element -> nodes per hexahedron
NODES = {"hex8": 8, "hex8i": 8, "hex20": 20, "hex27": 27}

# A hexahedron's K, and K with M, as times that of hex8's K, with the checks of its mesh.
_K = {"hex8": 2.0, "hex8i": 4.0, "hex20": 12.0, "hex27": 22.0}
_K_AND_M = {"hex8": 6.0, "hex8i": 9.0, "hex20": 18.0, "hex27": 36.0}
# Bytes per entry of K: of its upper triangle as a body keeps it, and of that of the free dofs with
# the columns that PARDISO reads.
_ENTRY, _COPIES = 6.0, 10.0
#: memory of the libraries, and of figures and pages
START_BYTES = 2.5e8


def dense_s(flops: float) -> float:
    """Seconds of dense algebra."""
    return flops / USUAL.dense_flops


@dataclass
class CostModel:
    """Predicted seconds and bytes of a run, added up piece by piece, and the linear solver of every
    task.
    """

    scene: AnyScene
    seconds: float = 0.0
    solver: dict[str, str] = field(default_factory=dict)
    kept_bytes: float = START_BYTES
    #: bytes of jobs of which several may run side by side
    jobs: list[float] = field(default_factory=list)
    #: of condensed bodies, by their place among the jobs: bytes that stay when their factor goes
    left: dict[int, float] = field(default_factory=dict)
    #: seconds of such jobs
    shared: float = 0.0

    @property
    def element(self) -> str:
        """The scene's element."""
        return str(self.scene.mesh.element)

    def solid(self, hexes: int, nodes: int) -> Solid:
        """Shape of a body of the scene."""
        return Solid.of(hexes, nodes, NODES[self.element])

    def contact_body(self, hexes: int, nodes: int) -> None:
        """A body meshed, with its K."""
        self.seconds += 0.2 + hexes * _K[self.element] / USUAL.elements
        self.kept_bytes += 3.0 * nodes * self.solid(hexes, nodes).entries * _ENTRY

    def dynamic_body(self, hexes: int, nodes: int, times: float = 1.0) -> None:
        """A body with its K and M."""
        self.seconds += times * (0.1 + hexes * _K_AND_M[self.element] / USUAL.elements)
        # M has no entries between components.
        self.kept_bytes += 4.0 * nodes * self.solid(hexes, nodes).entries * _ENTRY

    def choice(
        self, task: str, n_dof: int, n_kept: int, solid: Solid, *, direct: bool = False
    ) -> Prediction:
        """The solver of a task, "body, what", and its cost; ``direct``: one that factorises."""
        asked = self.scene.solver
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
        return select.predict(n_dof, n_kept, choice.name, solid)

    def condensed(self, task: str, hexes: int, nodes: int, n_kept: int) -> Prediction:
        """A body condensed onto its contact dofs."""
        solid = self.solid(hexes, nodes)
        found = self.choice(task, 3 * nodes, n_kept, solid)
        self.shared += found.seconds
        self._lets_go(task, nodes, n_kept, solid)
        self.jobs.append(found.bytes + 3.0 * nodes * solid.entries * _COPIES)
        return found

    def _lets_go(self, task: str, nodes: int, n_kept: int, solid: Solid) -> None:
        """The next job lets its factor go: K of the free dofs and what is dense stay. Multigrid and
        what is learned from products keep their solver.
        """
        if self.solver[task].startswith(("amg", select.PRODUCTS)):
            return
        K = 3.0 * nodes * solid.entries * _ENTRY
        self.left[len(self.jobs)] = select.DENSE * float(n_kept) ** 2 + K

    def contact(
        self, task: str, hexes: int, nodes: int, n_kept: int, products: int, room: float
    ) -> Prediction:
        """A body condensed onto its contact dofs, or seen by so many products, in ``room`` bytes
        where a way fits.
        """
        solid, asked = self.solid(hexes, nodes), self.scene.solver
        copies = 3.0 * nodes * solid.entries * _COPIES
        ways = contact_routes(
            3 * nodes,
            n_kept,
            products,
            solver=asked.name,
            memory_limit_bytes=asked.memory,
            solid=solid,
        )
        choice, found = choose_route(
            ways, products, route=asked.route, memory_limit_bytes=room - copies
        )
        self.solver[task] = f"{choice.name}: {choice.why}"
        self.shared += found.seconds
        self._lets_go(task, nodes, n_kept, solid)
        self.jobs.append(found.bytes + copies)
        return found

    def held_in_mean(self, task: str, hexes: int, nodes: int) -> None:
        """What a body that was condensed takes more where a weighted set holds it: another factor,
        for the displacements under six tractions over the set.
        """
        name = self.solver[task].partition(":")[0]
        found = select.predict(3 * nodes, 0, name, self.solid(hexes, nodes))
        again = found.seconds if name == "amg" else found.substitution()
        self.shared += found.seconds + 5.0 * again

    def modes(self, task: str, hexes: int, nodes: int, times: int = 1) -> None:
        """``times`` the lowest modes of a body: its factor, Lanczos with about sixty right sides,
        and another factor that counts the modes.
        """
        solid = self.solid(hexes, nodes)
        found = self.choice(task, 3 * nodes, 0, solid, direct=True)
        # The second matrix is ordered again, but checked no more.
        one = 0.15 + 1.5 * found.seconds + 1.5 * found.factor_seconds
        one += 30.0 * found.substitution()
        self.shared += times * one
        self.jobs += times * [2.0 * found.bytes + 3.0 * nodes * solid.entries * _COPIES]

    def reduction(self, task: str, hexes: int, nodes: int, n_kept: int, modes: int) -> None:
        """A body reduced to its kept dofs and some of its modes: its Schur complement, a right side
        per kept dof, modes with these held.
        """
        solid = self.solid(hexes, nodes)
        found = self.choice(task, 3 * nodes, n_kept, solid, direct=True)
        columns = 0.5 * n_kept * found.substitution()
        columns += dense_s(2.0 * 3.0 * nodes * float(n_kept) ** 2)
        lanczos = 0.15 + 1.5 * found.seconds + _lanczos(modes) * found.substitution()
        self.shared += found.seconds + columns + lanczos
        self.jobs.append(
            3.0 * found.bytes
            + 3.0 * 24.0 * nodes * n_kept
            + 2.0 * 3.0 * nodes * solid.entries * _COPIES
        )

    def attached(self, task: str, hexes: int, nodes: int, loads: int, modes: int) -> None:
        """A body reduced to its lowest modes and its displacements under loads: the factor of both,
        in its place another that counts the modes, a right side per load.
        """
        solid = self.solid(hexes, nodes)
        found = self.choice(task, 3 * nodes, 0, solid, direct=True)
        columns = 0.5 * loads * found.substitution()
        columns += dense_s(4.0 * 3.0 * nodes * float(loads) ** 2)
        columns += _lanczos(modes) * found.substitution()
        self.shared += 0.15 + 3.0 * found.seconds + columns
        self.jobs.append(
            found.bytes + 4.0 * 24.0 * nodes * loads + 2.0 * 3.0 * nodes * solid.entries * _COPIES
        )

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

    def limit(self) -> float:
        """Bytes that may be used."""
        asked = self.scene.solver.memory
        return asked if asked is not None else select.memory_left()

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
        while many > 1 and self.kept_bytes + sum(left) + sum(more[:many]) > self.limit():
            many -= 1
        return self.kept_bytes + sum(left) + sum(more[:many]), many

    def side_by_side(self, workers: int, jobs: int) -> tuple[float, int]:
        """Bytes when so many of ``jobs`` tasks run at the same time, and how many: ``workers``, or
        fewer where these do not fit.
        """
        each = max(self.jobs, default=0.0)
        while workers > 1 and self.kept_bytes + min(workers, jobs) * each > self.limit():
            workers -= 1
        return self.kept_bytes + min(workers, jobs) * each, workers

    def total(self, workers: int) -> float:
        """Seconds by the clock, with so many workers on the jobs that may run side by side."""
        # Alone, a factorisation itself takes all threads; the gain is about the same.
        many = max(workers, 1) if workers > 1 else 2
        gain = USUAL.speedup if min(many, select.threads_used()) > 1 else 1.0
        return self.seconds + self.shared / gain


def _lanczos(modes: int) -> float:
    """Substitutions of pairs of right sides for so many modes (counted with 5 to 40 of them)."""
    return 14.0 + 1.6 * modes
