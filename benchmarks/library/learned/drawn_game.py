"""A test game of a track: what its episodes draw, and the costs that normalise scores."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ppg_env.env.randomize import Choice, Distribution, Randomize


@dataclass(frozen=True)
class DrawnGame:
    """A drawn game.

    Attributes
    ----------
    split : one of ``test`` and ``beyond``.
    start : start of each agent that plays, the first ones of the track's game.
    lam, noise : weight of time and variance per step, of all agents.
    straight, reference : mean cost of an agent in straight flight, and with the reference player.
    """

    split: str
    start: Sequence[Sequence[float]]
    lam: float
    noise: float
    straight: float = float("nan")
    reference: float = float("nan")

    def rule(self, track_rule: Randomize) -> Randomize:
        """Return the rule that draws this game, with the layout of ``track_rule``."""
        starts: dict[int | str, Distribution] = {
            i: Choice([tuple(place)]) for i, place in enumerate(self.start)
        }
        count = None if track_rule.agents is None else Choice([len(self.start)])
        return Randomize(
            start=starts,
            lam=Choice([self.lam]),
            noise=Choice([self.noise]),
            agents=count,
            shared=track_rule.shared,
        )
