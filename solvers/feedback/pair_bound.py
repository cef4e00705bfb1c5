r"""A proved lower bound on what two agents in the plane lose to each other.

Up to a time t* before which neither can arrive, positions x_i move by x_i' = x_i + B_i u_i + w_i.
With fixed vectors l_i, of which no input gains more than one step, l_i B_i u <= 1 on U_i, put

    L_t(x_1, x_2) = sum_i lam_i l_i (g_i - x_i) + P_t(x_1 - x_2).

The linear terms lose exactly lam_i l_i B_i u_i in a step, whatever the noise, so L bounds the sum
of both costs to go from below if P does so for a game of the displacement D alone,

    P_t(D) = min_u  sum_i lam_i (1 - l_i B_i u_i) + E[ P_{t+1}(D'); D' not in K ] + C Pr(D' in K),

D' = D + B_1 u_1 - B_2 u_2 + w_1 - w_2: it says what a detour, or the risk of none, costs.  C is the
cost of a crash of both less the linear terms, at most; at t* P is a bound on what is missing
between the linear terms and the costs that both have alone (:mod:`solvers.feedback.solo_table`).

This holds while the noise stays within some deviations of its law up to each time; the rest has a
small probability, whose share of L is subtracted.  Of K a box inside counts, at the time
steps only.  What happens after t* is not in the bound, nor what both need besides D.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ppg_env import tolerances as tol
from ppg_env.env.rules import Rules
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.polytope import Polytope, collision_set
from solvers.feedback.solo_grid import ROUNDING, SoloGrid, SoloProblem
from solvers.feedback.solo_table import image, make_axis, solo_table

FEWEST, MOST = 4.0, 5.5
"""Deviations within which noise is taken to stay: as many as leave the last time that the fewest
allow, but at most the most."""

NODES_PER_DEVIATION = 5.0
"""Nodes of the displacement's grid per standard deviation of its noise."""

MARGIN = 3
"""Steps by which the displacement's grid exceeds the way of the two."""


@dataclass(frozen=True, eq=False)
class _Mover:
    """One of two agents: what the bound needs of it.

    Attributes
    ----------
    agent : the agent.
    moves : corners (V, 2) of B U.
    pull : lam l.
    sigma : (2,) standard deviations of a step's noise.
    """

    agent: Agent
    moves: np.ndarray
    pull: np.ndarray
    sigma: np.ndarray

    @property
    def along(self) -> float:
        """Standard deviation of l w."""
        return float(np.linalg.norm(self.pull / self.agent.lam * self.sigma))

    @property
    def distance(self) -> float:
        """Steps l (g - x) at the start."""
        return float(self.pull @ (self.agent.goal - self.agent.start) / self.agent.lam)

    @property
    def back(self) -> float:
        """The most that an input can lose of l x."""
        return float((self.moves @ -self.pull).max() / self.agent.lam)


def pair_lower_bound(game: Game, pair: tuple[int, int], rules: Rules) -> float:
    """Return a proved lower bound on the sum of two agents' expected costs; 0 if none is found.

    It needs agents in the plane with positions as states, uncorrelated noise, one control set each,
    and arrival in a region.
    """
    movers = [_mover(game.agents[i], rules) for i in pair]
    first, second = movers
    if first is None or second is None:
        return 0.0
    crash = sum((1 - game.agents[i].lam) * game.crash_cost for i in pair)
    leave = [
        (1 - game.agents[i].lam) * game.crash_cost if rules.on_crash == "remove" else float("inf")
        for i in pair
    ]
    return max(0.0, _bound(game, (first, second), crash, leave, rules))


def _mover(agent: Agent, rules: Rules) -> _Mover | None:
    plane = agent.state_dim == agent.dim == agent.goal.size == 2
    if not plane or not isinstance(agent.control, Polytope) or agent.lam == 0:
        return None
    noise = np.diag(agent.noise)
    plain = np.array_equal(agent.noise, np.diag(noise)) and (noise > tol.DEVIATION**2).all()
    still = np.array_equal(agent.A, np.eye(2)) and not agent.sigma0.any()
    if not plain or not still or rules.arrival != "region" or rules.saturation != "clip":
        return None
    moves = image(agent.B, agent.control)
    if len(moves) < 3:
        return None
    hull = Polytope("vertices", (moves,))
    if (hull.offsets <= 0).any():
        return None
    steps = hull.normals / hull.offsets[:, None]
    way = steps @ (agent.goal - agent.start)
    slope = steps[way >= way.max() - 1e-9 * (1 + way.max())].mean(axis=0)
    slope = slope / float((moves @ slope).max())
    return _Mover(agent, moves, agent.lam * slope, np.sqrt(noise))


def _bound(
    game: Game,
    movers: tuple[_Mover, _Mover],
    crash: float,
    leave: list[float],
    rules: Rules,
) -> float:
    """Return the bound; minus infinity if the agents are too near to their goals, or crashes cheap."""
    time, sigmas = _last_before_arrival(movers, rules)
    if time < 1:
        return -np.inf
    linear = sum(mover.agent.lam * mover.distance for mover in movers)
    collision = collision_set(movers[0].agent.shape, movers[1].agent.shape)
    rests = [
        _missing(mover, rules, rules.steps(game) - time, time, cost, sigmas)
        for mover, cost in zip(movers, leave, strict=True)
    ]
    hit = crash - _most_linear(movers, collision, time, sigmas)
    if len(game.agents) > 2 or game.obstacles:  # one of the two may crash into something else
        for k, mover in enumerate(movers):
            alone = _farthest(mover, -mover.pull, time, sigmas) + mover.agent.lam * mover.distance
            hit = min(hit, leave[k] - alone + float(rests[1 - k].least[0].min()))
    if hit <= 0:
        return -np.inf
    grid = _PairGrid(movers, collision, hit, time, tol.LENGTH * game.unit)
    meeting, most = grid.solve_pair(rests[0], rests[1], time)
    return linear + meeting - _escaped(movers, linear + most, time, sigmas)


def _last_before_arrival(movers: tuple[_Mover, _Mover], rules: Rules) -> tuple[int, float]:
    """Return the last time at which no noise within bounds lets one arrive, and these bounds."""

    def deviations(time: int) -> float:
        rooms = []
        for mover in movers:
            reach = rules.tolerance * float(np.abs(mover.pull).sum()) / mover.agent.lam
            rooms.append((mover.distance - reach - time) / (mover.along * np.sqrt(time)))
        return min(rooms) * (1 - 1e-9)

    time = 0
    while deviations(time + 1) >= FEWEST:
        time += 1
    return time, min(MOST, deviations(time)) if time else 0.0


def _farthest(mover: _Mover, direction: np.ndarray, time: int, sigmas: float) -> float:
    """Return the most of direction (x - start) up to ``time``."""
    step = float((mover.moves @ direction).max())
    return max(0.0, time * step) + sigmas * float(np.abs(direction) @ mover.sigma) * time**0.5


def _most_linear(
    movers: tuple[_Mover, _Mover], collision: Polytope, time: int, sigmas: float
) -> float:
    """Return the most that the linear terms may be at a crash up to ``time``."""
    first, second = movers
    both = first.pull + second.pull
    ways = [sum(m.agent.lam * m.distance + _farthest(m, -m.pull, time, sigmas) for m in movers)]
    goals = sum(float(mover.pull @ mover.agent.goal) for mover in movers)
    for mover, gap in ((second, -first.pull), (first, second.pull)):
        there = goals + float((collision.vertices @ gap).max() - both @ mover.agent.start)
        ways.append(there + _farthest(mover, -both, time, sigmas))
    return min(ways)


def _escaped(movers: tuple[_Mover, _Mover], most: float, time: int, sigmas: float) -> float:
    """Return a bound on the expectation of L where the noise exceeds its bounds.

    At the first such time L is at most ``most`` plus the steps back and the noise of l x, whose
    expectation Cauchy and Schwarz bound.
    """
    from scipy.special import ndtr

    # Per agent and time: both sides of two components, and one of l w.
    chance = 2 * time * 5 * float(ndtr(-sigmas))
    back = sum(mover.agent.lam * mover.back for mover in movers) * time
    noise = sum(mover.agent.lam * mover.along for mover in movers) * np.sqrt(time)
    return chance * max(most + back, 0.0) + float(np.sqrt(chance)) * noise


@dataclass(frozen=True)
class _Rest:
    """What the linear term of one agent misses of its cost alone, as functions of one component.

    ``places`` are nodes, and ``least`` the minima over the cells from each of them on.
    """

    places: tuple[np.ndarray, np.ndarray]
    least: tuple[np.ndarray, np.ndarray]


def _missing(
    mover: _Mover, rules: Rules, steps: int, time: int, leave: float, sigmas: float
) -> _Rest:
    """Return lam V(x) - lam l (g - x) at ``time``, least over the other component."""
    agent = mover.agent
    reach = sigmas * np.sqrt(time) * mover.sigma
    low = agent.start + time * mover.moves.min(axis=0) - reach
    high = agent.start + time * mover.moves.max(axis=0) + reach
    cover = tuple((float(low[a]), float(high[a])) for a in range(2))
    table = solo_table(agent, (0, 1), steps, rules.tolerance, leave=leave, cover=cover)
    spans, places = [], []
    for a, axis in enumerate(table.axes):
        first = int((low[a] - axis.low) // axis.spacing)
        last = int((high[a] - axis.low) // axis.spacing) + 1
        spans.append(slice(first, last + 1))
        places.append(axis.nodes[spans[a]])
    rest = agent.lam * table.value[spans[0], spans[1]]
    offset = [mover.pull[a] * (places[a] - agent.goal[a]) for a in range(2)]
    rest = rest + np.add.outer(*offset)
    hull = Polytope("vertices", (mover.moves,))
    spacing = np.array([axis.spacing for axis in table.axes])
    faces = [(n, time * b) for n, b in zip(hull.normals, hull.offsets, strict=True)]
    for normal, most in faces:
        ahead = np.add.outer(normal[0] * places[0], normal[1] * places[1]) - normal @ agent.start
        rest = np.where(ahead > most + np.abs(normal) @ (reach + spacing), np.inf, rest)
    ahead = np.add.outer(*(mover.pull[a] * places[a] for a in range(2))) - mover.pull @ agent.start
    most = agent.lam * (time + sigmas * mover.along * np.sqrt(time))
    rest = np.where(ahead > most + np.abs(mover.pull) @ spacing, np.inf, rest)
    least = [rest.min(axis=1 - a) for a in range(2)]
    cells = [np.minimum(line[:-1], line[1:]) for line in least]
    return _Rest((places[0][:-1], places[1][:-1]), (cells[0], cells[1]))


class _PairGrid(SoloGrid):
    """Tables of the displacement's game."""

    def __init__(
        self,
        movers: tuple[_Mover, _Mover],
        collision: Polytope,
        hit: float,
        time: int,
        touch: float,
    ) -> None:
        first, second = movers
        sums = (first.moves[:, None] - second.moves[None]).reshape(-1, 2)
        self._corners = Polytope("vertices", (sums,)).vertices
        self._movers, self._hit = movers, hit
        self._start = first.agent.start - second.agent.start
        sigma = np.hypot(first.sigma, second.sigma)
        low, high = collision.bounds
        centre, half = (low + high) / 2, (high - low) / 2
        room = (collision.offsets - collision.normals @ centre) / (np.abs(collision.normals) @ half)
        half = half * max(float(room.min()), 0.0) - touch
        away = np.abs(self._corners).max(axis=0)
        best = [mover.moves[(mover.moves @ mover.pull).argmax()] for mover in movers]
        end = self._start + time * (best[0] - best[1])
        axes = []
        for a in range(2):
            ends = [self._start[a], end[a], low[a], high[a]]
            span = min(ends) - MARGIN * away[a], max(ends) + MARGIN * away[a]
            spacing = sigma[a] / NODES_PER_DEVIATION
            axes.append(make_axis(span, float(centre[a]), float(half[a]), spacing, float(sigma[a])))
        problem = SoloProblem(
            A=np.eye(2),
            moves=((0, self._corners),),
            slopes=np.zeros((1, 2)),
            axes=(axes[0], axes[1]),
            leave=hit,
            steps=time,
            pulls=np.zeros((0, 2)),
            short=np.zeros(0),
            inside=hit,
        )
        super().__init__(problem)

    def solve_pair(self, first: _Rest, second: _Rest, time: int) -> tuple[float, float]:
        """Return P_0 at the start, and the most of P."""
        value = np.full(self._shape, -np.inf)
        for a in range(2):
            line = self._convolved(a, first, second)
            np.maximum(value, line[:, None] if a == 0 else line[None, :], out=value)
        value = np.minimum(value, self._hit)
        floor = min(float(value.min()), 0.0)
        for _ in range(time):
            value = self._earlier(value, floor)
            floor -= ROUNDING * (1.0 + self._hit)
        rows = [
            axis.start(self._start[a], 0.0, arrived=False)
            for a, axis in enumerate(self._problem.axes)
        ]
        return float(rows[0] @ value @ rows[1]), max(self._hit, float(value.max()))

    def _earlier(self, value: np.ndarray, floor: float) -> np.ndarray:
        """Return the table one step earlier; ``floor`` bounds P off the grid."""
        within = self.after(value, floor)
        first, second = self._movers
        best = np.full(self._shape, -np.inf)
        for tangent in self._tangents():
            ways = (first.moves @ (first.pull + tangent)).max()
            ways += (second.moves @ (second.pull - tangent)).max()
            cost = first.agent.lam + second.agent.lam - float(ways)
            np.maximum(best, self.least(within, self._corners, tangent) + cost, out=best)
        rim = self.left(self._corners)
        best[rim] = np.minimum(best[rim], floor)
        return np.minimum(best, self._hit) - ROUNDING * (1.0 + self._hit)

    def _tangents(self) -> np.ndarray:
        """Return slopes of tangents to the least cost of a displacement's step."""
        first, second = (mover.pull for mover in self._movers)
        shares = (0.0, 0.5, 1.0)
        return np.unique([q * second - p * first for p in shares for q in shares], axis=0)

    def _convolved(self, a: int, first: _Rest, second: _Rest) -> np.ndarray:
        """Return (n,) bounds around each node on first(z) + second(z - D_a), over z."""
        axis = self._problem.axes[a]
        widths = [float(rest.places[a][1] - rest.places[a][0]) for rest in (first, second)]
        gaps = np.subtract.outer(first.places[a], second.places[a])
        sums = np.add.outer(first.least[a], second.least[a])
        low = np.ceil((gaps - widths[1] - axis.low) / axis.spacing - 1).astype(int)
        high = np.floor((gaps + widths[0] - axis.low) / axis.spacing + 1).astype(int)
        line = np.full(axis.count, np.inf)
        for k in range(int((high - low).max()) + 1):
            place = np.minimum(low + k, high)
            on = (place >= 0) & (place < axis.count)
            np.minimum.at(line, place[on], sums[on])
        known = np.isfinite(line)
        most = float(line[known].max()) if known.any() else 0.0
        return np.where(known, line, most)
