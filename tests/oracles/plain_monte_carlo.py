"""Profiles whose crash probabilities were counted once in 10^8 plain episodes each.

Three kinds, each at noises that make crashes about 1e-3, 1e-4 and 1e-5 likely:

    side     two agents abreast: one face for many times in a row
    corner   two agents that cross one after the other: a corner, for few times
    crowd    three unlike agents and two obstacles: many pairs, one a double integrator

The counts are in plain.json, with their seed, instants and swept from the same episodes.  This
made them, in ten minutes of one core:  ``python -m tests.oracles.plain_monte_carlo``
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ppg_env import Agent, Game, Polytope, make_game, straight_plan
from ppg_env.formats.plan_file import to_json
from ppg_env.game.plan import Profile
from ppg_env.risk.monte_carlo import paired_counts
from tests.ppg_env.strategies import double_integrator

FILE = Path(__file__).with_suffix(".json")
SAMPLES, SEED = 100_000_000, 7

CASES = {
    "side 1e-3": ("side", 1.846),
    "side 1e-4": ("side", 1.385),
    "side 1e-5": ("side", 1.107),
    "corner 1e-3": ("corner", 0.682),
    "corner 1e-4": ("corner", 0.434),
    "corner 1e-5": ("corner", 0.315),
    "crowd 1e-3": ("crowd", 2.413),
    "crowd 1e-4": ("crowd", 1.702),
    "crowd 1e-5": ("crowd", 1.302),
}
"""Kind and noise of each case."""


def case(name: str) -> tuple[Game, Profile]:
    """A game and the profile that is flown in it."""
    kind, noise = CASES[name]
    return {"side": side, "corner": corner, "crowd": crowd}[kind](noise)


def side(noise: float) -> tuple[Game, Profile]:
    """Eight steps side by side, 8 between the bodies."""
    game = make_game("parallel", start={1: [10.0, 47.0]}, goal={1: [95.0, 47.0]}, noise=noise)
    return game, fly(game)


def corner(noise: float) -> tuple[Game, Profile]:
    """Paths cross, and at one instant the displacement is just beyond a corner of K."""
    body, control = Polytope.box([15.0, 15.0]), Polytope.box([20.0, 20.0])
    agents = (
        Agent([-42.5, 0], [37.5, 0], body, control, gain=0.5, noise=noise),
        Agent([0, -77.5], [0, 2.5], body, control, gain=0.5, noise=noise),
    )
    game = Game(agents)
    return game, fly(game)


def crowd(noise: float) -> tuple[Game, Profile]:
    """Agents of other shapes, gains and dynamics, between two obstacles."""
    A, B = double_integrator(2)
    gain = np.hstack([0.3 * np.eye(2), 0.8 * np.eye(2)])
    skewed = noise * np.array([[1.0, 0.3], [0.3, 0.6]])
    spread = 0.05 * noise * np.eye(4)
    control = Polytope.box([20.0, 20.0])
    agents = (
        Agent([0, 0], [60, 0], Polytope.box([6, 4]), control, gain=0.5, noise=noise),
        Agent([0, 14], [60, 16], Polytope.disc(3.0, 7), control, gain=0.2, noise=skewed),
        Agent([60, -15, 0, 0], [0, -15], Polytope.l1(4.0), control, 0.5, gain, spread, A, B, 0.1),
    )
    walls = (
        Polytope.from_vertices([[20, 24], [45, 24], [45, 40], [20, 40]]),
        Polytope.from_vertices([[20, -40], [50, -40], [35, -25]]),
    )
    game = Game(agents, walls, horizon=12)
    return game, fly(game)


def fly(game: Game) -> Profile:
    """Straight plans."""
    plans = [straight_plan(agent, game.horizon) for agent in game.agents]
    return tuple(plan for plan in plans if plan is not None)


def count() -> None:
    """Count every case and write the file."""
    found = {}
    for name in CASES:
        flown = case(name)
        counts = paired_counts(flown, flown, SAMPLES, SEED, swept=(False, True))
        both = {"instants": counts.first, "swept": counts.second}
        found[name] = {
            way: {"agents": c.agents, "encounters": c.encounters, "any": c.any}
            for way, c in both.items()
        }
    FILE.write_text(to_json({"samples": SAMPLES, "seed": SEED, "counts": found}) + "\n")


def counted() -> dict:
    """What the file holds."""
    return json.loads(FILE.read_text(encoding="utf-8"))


if __name__ == "__main__":
    count()
