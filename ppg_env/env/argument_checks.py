"""Checks of the arguments with which simulators and views are made."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ppg_env.env.rules import CHOICES, Rules
from ppg_env.errors import InputError, require
from ppg_env.formats.game_file import AGENT_KEYS, GAME_KEYS
from ppg_env.formats.keys import nearest
from ppg_env.game.game import Game
from ppg_env.support.validation import is_whole

RULES = (*CHOICES, "tolerance", "schedule", "max_cycles")
OPTIONS = tuple(dict.fromkeys((*RULES, "speed", "obstacles", *GAME_KEYS, *AGENT_KEYS)))
"""Rules and fields of the game, options of every view that is made from a game."""

OF_ALL_VIEWS = ("observation", "randomize")
OF_SINGLE_VIEWS = {"render_mode": None, "infos": "numbers"}
"""Parameters of views of one game, with the only values that batches of copies have."""

SYNONYMS = {"num_envs": "copies", "n_envs": "copies", "batch_size": "copies", "copies": "num_envs"}
"""What other libraries, or other views, call a parameter."""


def check_simulation(game: Any, rules: Any, copies: Any) -> None:
    """Raise :class:`InputError` unless ``copies`` of ``game`` can be simulated under ``rules``."""
    require(isinstance(game, Game), "game", f"is {game!r:.60}", "give a Game, as make_game makes")
    fits = rules is None or isinstance(rules, Rules)
    require(fits, "rules", f"are {rules!r:.60}", 'give Rules, such as Rules(reward="margin")')
    whole = is_whole(copies) and copies >= 1
    require(whole, "copies", f"is {copies!r:.60}", "ask for a whole number, at least one")


def check_options(options: Mapping[str, Any], view: Any, hidden: Sequence[str] = ()) -> None:
    """Refuse the first of ``options`` that the class ``view`` does not take.

    Raises
    ------
    InputError
        If there is one; the remedy is the nearest of the names that the view takes, its own
        parameters included, or all of them, less those that are ``hidden``.
    """
    taken = (*OF_ALL_VIEWS, *OF_SINGLE_VIEWS, *OPTIONS)
    unknown = next((key for key in options if key not in taken), None)
    if unknown is None:
        return
    own = [
        name
        for name, parameter in inspect.signature(view.__init__).parameters.items()
        if name != "self" and parameter.kind is not parameter.VAR_KEYWORD
    ]
    names = [name for name in dict.fromkeys((*own, *taken)) if name not in hidden]
    synonym = SYNONYMS.get(unknown, "")
    remedy = f"perhaps you mean {synonym!r}" if synonym in names else nearest(unknown, names)
    raise InputError(unknown, "is not an option", remedy)


def check_batch_options(options: Mapping[str, Any], view: Any) -> None:
    """Refuse ``options`` that ``view``, a class of batches of copies, does not take.

    Raises
    ------
    InputError
        If one is unknown, or has a value that only views of one game have.
    """
    check_options(options, view, tuple(OF_SINGLE_VIEWS))
    for name, plain in OF_SINGLE_VIEWS.items():
        given = options.get(name, plain)
        remedy = (
            f"leave it out: only parallel_env and SingleAgentEnv have other values than {plain}"
        )
        require(given == plain, name, f"is {given!r:.60}", remedy)


def check_learner(learner: Any, players: Mapping[int, Any] | None, agents: int) -> None:
    """Raise :class:`InputError` unless ``learner`` is one of so many ``agents``.

    The others that ``players`` names need a method ``act``.
    """
    among = is_whole(learner) and 0 <= learner < agents
    require(among, "learner", f"is {learner!r:.60} of {agents}", "count from 0")
    _check_players(players, (learner,), agents)


def check_learners(learners: Any, players: Mapping[int, Any] | None, agents: int) -> list[int]:
    """Return the numbers of the ``learners``, all of so many ``agents`` where they are None.

    Raises
    ------
    InputError
        If one is no agent or comes twice, or one of the others' ``players`` does not fit.
    """
    given = list(range(agents)) if learners is None else learners
    listed = isinstance(given, (Sequence, np.ndarray)) and not isinstance(given, str)
    fit = listed and all(is_whole(i) and 0 <= i < agents for i in given)
    require(
        fit and len(given) == len({*given}) > 0,
        "learners",
        f"are {learners!r:.60} of {agents} agents",
        "give different numbers of agents, counted from 0",
    )
    _check_players(players, given, agents)
    return [int(i) for i in given]


def _check_players(
    players: Mapping[int, Any] | None, learners: Sequence[int] | np.ndarray, agents: int
) -> None:
    given = {} if players is None else players
    named = isinstance(given, Mapping)
    remedy = "write a dictionary from agents to players"
    require(named, "players", f"are {players!r:.60}", remedy)
    for agent, player in given.items():
        other = is_whole(agent) and 0 <= agent < agents and agent not in learners
        require(other, "players", f"names agent {agent!r:.60}", "name the other agents only")
        plays = callable(getattr(player, "act", None))
        remedy = "give an object with a method act(view), such as GoToGoal(game, 1)"
        require(plays, f"players[{agent}]", f"is {player!r:.60}", remedy)
