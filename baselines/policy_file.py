"""Files of learned players: NumPy arrays and a JSON text, without code.

A file holds the runs of one training, one run per seed, each a team of policies:

    about                              JSON: format, version, player, game, sharing, lam, seeds, ...
    run<r>_agent<i>_weight<k>, _bias<k>    layer k; agent 0 alone if the policy is shared
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from baselines.policy import LearnedPlayer, Policy, Team, team_players
from ppg_env.env.players import Player
from ppg_env.env.randomize import Distribution, Randomize
from ppg_env.env.rule_tables import randomize_from_table
from ppg_env.errors import InputError, placed, require
from ppg_env.formats.game_file import game_from_tables
from ppg_env.formats.plan_file import to_json
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.support.archives import about_json, opened_archive
from ppg_env.support.atomic_write import write_atomically
from ppg_env.support.read_file import MIB

FORMAT = "path-planning-games/learned"
VERSION, WITH_EXPERTS = 1, 2
"""Version of files, and of those whose networks have experts: earlier releases refuse them."""

REMEDY = "give a file that ppg train wrote"

LARGEST = 256 * MIB
"""Bytes of all networks of a file."""

PHYSICS = ("start", "goal", "shape", "control", "noise", "A", "B", "sigma0")
"""Fields of an agent that a policy depends on; gains are the planners', lam may be an input."""


@dataclass(frozen=True)
class Learned:
    """Trained players.

    Attributes
    ----------
    runs : one team per training seed.
    about : the game, the method and its figures; plain JSON values.
    """

    runs: tuple[Team, ...]
    about: dict[str, Any]

    @property
    def name(self) -> str:
        """Name of the players, such as ``ppo-selfish``."""
        return str(self.about["player"])

    def players(self, game: Game, run: int = 0) -> list[Player]:
        """Return one player per agent, from the training with the ``run``-th seed."""
        return list(team_players(game, self.runs[run]))

    def policy(
        self, game: Game, agent: int | str, run: int = 0
    ) -> Callable[[np.ndarray], np.ndarray]:
        """Return the policy of one agent: from an observation (W,) of the environment to (m,).

        It plays in the loop of PettingZoo's or Gymnasium's view, with the agent's own lam.

        Parameters
        ----------
        game : the game that is played.
        agent : its name or index.
        run : the training, counted from 0.

        Raises
        ------
        InputError
            If there is no such agent, or it has no policy of its own.
        """
        names = game.agent_names
        i = names.index(agent) if agent in names else agent
        known = isinstance(i, int) and 0 <= i < len(names)
        require(known, "agent", f"is {agent!r}", "write " + " or ".join(names))
        player, lam = self.players(game, run)[int(i)], np.array([game.agents[int(i)].lam])
        if not isinstance(player, LearnedPlayer):
            raise InputError(
                names[int(i)], "was not trained", "play an agent with a policy of its own"
            )
        return lambda observation: player.actions(observation[None], lam)[0]

    def fits(self, game: Game) -> bool:
        """Return whether they were trained for this game; gains and objective are ignored.

        A lam or a noise that training drew may be any between the least and the largest draw.
        """
        trained = game_from_tables(self.about["game"], "game")
        table = self.about.get("randomize")
        rule = Randomize() if table is None else randomize_from_table(table)
        one_lam = self.about["lam"] is not None or "lam" in rule.shared  # for all agents
        same = (
            len(trained.agents) == len(game.agents)
            and trained.obstacles == game.obstacles
            and trained.horizon == game.horizon
            and trained.crash_cost == game.crash_cost
            and (not one_lam or len({agent.lam for agent in game.agents}) == 1)
        )
        return same and all(
            _same(theirs, _with_drawn_noise(ours, theirs, noise))
            and _between(ours.lam, self.about["lam"] or _limits(lam, theirs.lam))
            for ours, theirs, lam, noise in zip(
                game.agents,
                trained.agents,
                rule.each("lam", trained.agent_names),
                rule.each("noise", trained.agent_names),
                strict=True,
            )
        )


def _limits(draw: Distribution | None, own: float) -> list[float]:
    """Return the least and the largest value that training had."""
    values = [np.array([own])] if draw is None else draw.extremes(np.array([own]))
    return [float(min(v[0] for v in values)), float(max(v[0] for v in values))]


def _between(value: float, limits: Sequence[float]) -> bool:
    return bool(limits[0] <= value <= limits[1])


def _with_drawn_noise(ours: Agent, theirs: Agent, draw: Distribution | None) -> Agent:
    """Return our agent, with the noise of theirs if training may have drawn ours."""
    s = float(ours.noise[0, 0])
    alike = np.array_equal(ours.noise, s * np.eye(len(ours.noise)))
    own = float(np.trace(theirs.noise) / len(theirs.noise))
    if draw is None or not alike or not _between(s, _limits(draw, own)):
        return ours
    return replace(ours, noise=theirs.noise)


def _same(ours: Agent, theirs: Agent) -> bool:
    return all(
        np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b
        for a, b in ((getattr(ours, key), getattr(theirs, key)) for key in PHYSICS)
    )


def write_learned(path: str | Path, learned: Learned) -> Path:
    """Save ``learned`` as an .npz file, which ``ppg compare`` and ``ppg regret`` take as a player.

    Raises
    ------
    InputError
        If ``learned`` has no runs, or ``about`` lacks what a file has to say: ``player``, a name;
        ``game``, the tables of a game file as in :func:`ppg_env.game_to_tables`; and
        ``lam``, two limits or None.
    """
    _check_complete(learned, "learned", "give what write_learned describes")
    arrays: dict[str, Any] = {}
    for r, team in enumerate(learned.runs):
        for i, policy in enumerate(team):
            if policy is not None:
                for k, (weight, bias) in enumerate(zip(policy.weights, policy.biases, strict=True)):
                    arrays[f"run{r}_agent{i}_weight{k}"] = weight
                    arrays[f"run{r}_agent{i}_bias{k}"] = bias
    layers = [[_layers(policy) for policy in team] for team in learned.runs]
    experts = any(policy.experts > 1 for team in learned.runs for policy in team if policy)
    version = WITH_EXPERTS if experts else VERSION
    about = {"format": FORMAT, "version": version, **learned.about, "runs": layers}
    content = io.BytesIO()
    np.savez(content, about=np.array(to_json(about)), **arrays)
    return write_atomically(path, content.getvalue())


def _layers(policy: Policy | None) -> dict[str, Any] | None:
    """Return what is written about a policy in addition to its arrays."""
    if policy is None:
        return None
    return {
        "layers": len(policy.weights),
        "activation": policy.activation,
        "squash": policy.squash,
        "conditioned": policy.conditioned,
        **({"drawn": policy.drawn, "shared": policy.shared} if policy.drawn else {}),
        **({"experts": policy.experts} if policy.experts > 1 else {}),
    }


def read_learned(path: str | Path) -> Learned:
    """Load learned players; no code of the file is run.

    Raises
    ------
    InputError
        If the file is missing, was not written by :func:`write_learned`, or is damaged.
    """
    source = str(path)
    with opened_archive(path, REMEDY, LARGEST) as arrays:
        learned = _read(source, arrays)
    _check_complete(learned, source, REMEDY)
    return learned


def _check_complete(learned: Learned, place: str, remedy: str) -> None:
    """Refuse players without runs, and those that do not say what was trained."""
    about, lam = learned.about, learned.about.get("lam")
    require(bool(learned.runs) and all(learned.runs), place, "has no players", remedy)
    for key, holds, wanted in (
        ("player", isinstance(about.get("player"), str), "a name"),
        ("game", isinstance(about.get("game"), dict), "the tables of a game file"),
        ("lam", lam is None or (isinstance(lam, list) and len(lam) == 2), "two limits, or none"),
    ):
        require(holds, place, f"does not say what was trained: {key!r} is not {wanted}", remedy)


def _read(source: str, arrays: Any) -> Learned:
    """Return the players in an archive; errors of all kinds pass through."""
    about = about_json(arrays)
    known = isinstance(about, dict) and about.get("format") == FORMAT
    require(known, source, "is not a file of learned players", REMEDY)
    require(
        about.get("version") in (VERSION, WITH_EXPERTS),
        source,
        f"has version {about.get('version')!r:.40}",
        f"train again with this release, which reads versions {VERSION} and {WITH_EXPERTS}",
    )
    with placed(source, ": "):
        runs = tuple(
            tuple(_policy(arrays, r, i, layers) for i, layers in enumerate(team))
            for r, team in enumerate(about.pop("runs"))
        )
    return Learned(runs, about)


def _policy(arrays: Any, run: int, agent: int, layers: dict[str, Any] | None) -> Policy | None:
    if layers is None:
        return None
    name = f"run{run}_agent{agent}"
    count = range(int(layers["layers"]))
    return Policy(
        tuple(arrays[f"{name}_weight{k}"] for k in count),
        tuple(arrays[f"{name}_bias{k}"] for k in count),
        layers["activation"],
        bool(layers["squash"]),
        bool(layers["conditioned"]),
        tuple(map(str, layers.get("drawn", ()))),
        tuple(map(str, layers.get("shared", ()))),
        int(layers.get("experts", 1)),
    )
