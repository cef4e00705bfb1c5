"""The likeliest crash of a plan for ``ppg risk --explain``: its report and its tables."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.crash_risk.analytic import power
from benchmarks.crash_risk.query import RiskQuery, at_most, parties
from benchmarks.terminal import outward, print_note, print_table
from ppg_env.errors import InputError
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from ppg_env.risk.likeliest_crash import LikeliestCrash, likeliest_crash
from ppg_env.risk.lower_bounds import lower_bounds
from ppg_env.risk.union_bounds import risk_bounds


@dataclass(frozen=True, eq=False)
class Explanation:
    """The likeliest crash of a plan, if there is one, and the limits of any crash."""

    game: Game
    profile: Profile
    crash: LikeliestCrash | None
    any: tuple[float, float]

    def report(self) -> dict[str, Any] | None:
        """Return the crash for ``--json``; None if no noise leads to one."""
        game, crash = self.game, self.crash
        if crash is None:
            return None
        encounter, exact = game.encounters[crash.encounter], crash.log_probability
        return {
            "agents": encounter.agents,
            "obstacle": encounter.obstacle,
            "time": crash.time,
            "share": crash.share,
            "faces": crash.faces,
            "normal": crash.normal,
            "beta": crash.beta,
            "form": np.exp(crash.log_form),
            "log10_form": crash.log_form / np.log(10),
            "probability": None if exact is None else np.exp(exact),
            "log10_probability": None if exact is None else exact / np.log(10),
            "any": self.any,
            "deviations": crash.deviations,
            "noise": crash.noise,
            "obstacle_deviations": crash.obstacle,
        }

    def sentence(self) -> str:
        """Return what crashes when, through which face, and how likely it is."""
        game, crash = self.game, self.crash
        if crash is None:
            return "Likeliest crash: none, since no noise leads to one."
        names = " and ".join(parties(game, game.encounters[crash.encounter]))
        when = f"at t = {crash.time}"
        if crash.share < 1.0:
            when = f"after {crash.share:.2f} of the step to t = {crash.time}"
        if not crash.beta:
            return f"Likeliest crash: {names} {when}, along their means: no noise is needed."
        where = "a face" if len(crash.faces) == 1 else "a corner" if crash.faces else "no face"
        estimate = f"beta {crash.beta:.4g}, first-order estimate {power(crash.log_form)}"
        if crash.log_probability is not None:
            estimate += f", exactly {power(crash.log_probability)}"
        low, high = outward(self.any[0], ".2e", up=False), at_most(self.any[1])
        touch = f"through {where} with normal {_vector(crash.normal)}"
        return (
            f"Likeliest crash: {names} {when}, {touch}.\n"
            f"{estimate}; any crash of the plan: [{low}, {high}]."
        )

    def print(self) -> None:
        """Print the crash, and the deviations of its parties at each time."""
        game, crash = self.game, self.crash
        print_note(self.sentence())
        if crash is None or not crash.beta:
            return
        encounter = game.encounters[crash.encounter]
        columns, cells = ["t"], [[str(t) for t in range(crash.time + 1)]]
        for i in encounter.agents:
            name, means = game.agent_names[i], self.profile[i].means
            columns += [f"{name} mean", "deviation", "noise of the step"]
            noise = [*(_vector(step) for step in crash.noise[i]), ""]
            path = [_vector(row) for row in crash.deviations[i]]
            cells += [[_vector(row) for row in means[: crash.time + 1]], path, noise]
        if crash.obstacle is not None:
            columns.append(f"obstacle {encounter.obstacle} deviation")
            cells.append([_vector(row) for row in crash.obstacle])
        print_table("The path to it", columns, list(zip(*cells, strict=True)))


def explain(query: RiskQuery) -> Explanation:
    """Return the likeliest crash of the event of the query.

    Raises
    ------
    InputError
        If the player has no plan.
    """
    game, profile = query.game, query.profile
    if profile is None:
        raise InputError("--explain", "is for plans, and this player has none", "name a planner")
    game = replace(game, collisions="swept" if query.swept else "instants")
    bounds = risk_bounds(game, profile)
    limits = lower_bounds(game, profile, bounds)[1], bounds.any.tree
    return Explanation(game, profile, likeliest_crash(game, profile, bounds), limits)


def _vector(values: np.ndarray) -> str:
    """Return a vector as text; components that are rounding errors of another one are zero."""
    kept = np.where(np.abs(values) > 1e-9 * np.abs(values).max(), values, 0.0)
    return "(" + ", ".join(f"{value:.3g}" for value in kept) + ")"
