"""Two agents on a line by dynamic programming, sharing no code with :mod:`ppg_env`.

Positions are whole multiples of a grid step.  For given arrivals and sides, the paper's programs
on a line ask for the minimum of a sum of convex functions of position differences,

    sum_t omega_t c(x_t - y_t)   subject to   |x_{t+1} - x_t| <= limit,

which has a solution on the grid whenever limits, starts, goals and the kinks of c lie on it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from math import erfc, inf, sqrt

from ppg_env import Agent, Game, Polytope


@dataclass(frozen=True)
class Line:
    """Two agents of length 1 on a line; ``gain`` 1 makes their noise the same at all t >= 1.

    ``later`` is a step, and the limits that hold from it on.
    """

    starts: tuple[int, int]
    goals: tuple[int, int]
    limits: tuple[int, int]
    later: tuple[int, tuple[int, int]] | None = None
    lam: tuple[float, float] = (0.5, 0.5)
    noise: tuple[float, float] = (0.25, 0.25)
    gain: float = 1.0
    objective: str = "margin"
    cap: float = 2.0
    crash_cost: float = 20.0
    scale: str = "exact"
    horizon: int = 6

    @property
    def game(self) -> Game:
        agents = tuple(
            Agent(
                start=[self.starts[i]],
                goal=[self.goals[i]],
                shape=Polytope.box([1.0]),
                control=self.control(i),
                lam=self.lam[i],
                gain=self.gain,
                noise=self.noise[i],
            )
            for i in (0, 1)
        )
        return Game(
            agents=agents,
            horizon=self.horizon,
            objective=self.objective,
            margin_cap=self.cap,
            crash_cost=self.crash_cost,
            scale=self.scale,
        )

    def control(self, agent: int) -> Polytope | tuple[tuple[int, Polytope], ...]:
        first = Polytope.box([2.0 * self.limits[agent]])
        if self.later is None:
            return first
        return ((0, first), (self.later[0], Polytope.box([2.0 * self.later[1][agent]])))

    def moves(self, agent: int, t: int, step: float) -> range:
        """Grid steps that the agent may take at time t."""
        limits = self.limits
        if self.later is not None and t >= self.later[0]:
            limits = self.later[1]
        most = round(limits[agent] / step)
        return range(-most, most + 1)

    def ahead(self, agent: int, t: int, x: int | None, step: float) -> list[int | None]:
        """Grid positions one step after time t from which the goal is still within reach."""
        if x is None:
            return [None]
        goal = round(self.goals[agent] / step)
        left = sum(self.moves(agent, k, step)[-1] for k in range(t + 1, self.horizon))
        return [x + u for u in self.moves(agent, t, step) if abs(goal - x - u) <= left] or [x]

    @property
    def units(self) -> list[float]:
        """Length of a unit of margin at each time."""
        variances = [0.0]
        for _ in range(self.horizon):
            variances.append((1 - self.gain) ** 2 * variances[-1] + sum(self.noise))
        return [sqrt(v * (2 if self.scale == "exact" else 1)) for v in variances]

    def loss(self, t: int, apart: float) -> float:
        """Loss of the pair at distance ``apart``; infinite when they overlap."""
        room = abs(apart) - 1.0
        if room < -1e-9:
            return inf
        margin = self.cap if self.units[t] == 0 else min(self.cap, room / self.units[t])
        if self.objective == "margin":
            return self.cap - margin
        return self.crash_cost * erfc(margin) / 2


def weights_of(line: Line, what: str) -> tuple[tuple[float, float], float]:
    """Cost of a step of each agent's time, and weight of the pair's loss."""
    (p, q) = line.lam
    if what == "social":
        return (p, q), (1 - p) + (1 - q)
    if what == "potential":
        return (p / (1 - p), q / (1 - q)), 1.0
    raise KeyError(what)


def joint_optimum(line: Line, what: str, step: float = 1.0) -> float:
    """MP3, or the potential's minimum, over all pairs of paths on the grid of ``step``."""
    tau, omega = weights_of(line, what)
    goals = [round(goal / step) for goal in line.goals]
    losses = _losses(line, step)

    @cache
    def least(t: int, x: int | None, y: int | None) -> float:
        x, y = (None if x == goals[0] else x), (None if y == goals[1] else y)
        if x is None and y is None:
            return 0.0
        if t == line.horizon:
            return inf
        price = tau[0] * (x is not None) + tau[1] * (y is not None)
        if x is not None and y is not None:
            price += omega * losses(t, x - y)
        if price == inf:
            return inf
        return price + min(
            least(t + 1, a, b) for a in line.ahead(0, t, x, step) for b in line.ahead(1, t, y, step)
        )

    return least(0, round(line.starts[0] / step), round(line.starts[1] / step))


def best_response_value(
    line: Line, agent: int, other: Sequence[float], step: float = 1.0, care: float | None = None
) -> float:
    """MP2: least own cost of ``agent`` against the path ``other`` (H+1 positions).

    ``care`` is the weight of the pair's losses, unless it is the agent's own.
    """
    goal = round(line.goals[agent] / step)
    there = line.goals[1 - agent]
    gone = next((t for t, place in enumerate(other) if abs(place - there) < 1e-9), inf)
    lam = line.lam[agent]
    care = 1 - lam if care is None else care

    @cache
    def least(t: int, x: int) -> float:
        if x == goal:
            return 0.0
        if t == line.horizon:
            return inf
        pair = line.loss(t, x * step - other[t]) if t < gone else 0.0
        if pair == inf:
            return inf
        ahead = line.ahead(agent, t, x, step)
        return lam + care * pair + min((least(t + 1, a) for a in ahead), default=inf)

    return least(0, round(line.starts[agent] / step))


def _losses(line: Line, step: float) -> Callable[[int, int], float]:
    return cache(lambda t, apart: line.loss(t, apart * step))
