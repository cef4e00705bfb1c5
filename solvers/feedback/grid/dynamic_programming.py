"""Feedback policies of two agents by dynamic programming on a grid of their joint state.

Crashes and arrivals have their Gaussian probabilities; the noise is integrated exactly against a
cubic interpolant of the costs; the policies look one step ahead with actions between those of the
grid.  Both agents observe both states and the clock.

An overlap and an arrival in the same step count as independent of each other, and random starts as
their means.  Where bodies can overlap at the border of an arrival region, values are too high and
policies too careful: by 5 % and 3 % in a game on a line whose goals are closer to each other than
the bodies are wide.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import monotonic

from ppg_env.env.episodes import check_players
from ppg_env.env.players import Player
from ppg_env.env.rules import Rules
from ppg_env.errors import require
from ppg_env.game.game import Game
from solvers.feedback.grid.backward import Chooser, memory, solve_backward
from solvers.feedback.grid.choosers import STARTS, JointOptimum, Response, StageEquilibrium
from solvers.feedback.grid.feedback_solution import FeedbackSolution
from solvers.feedback.grid.joint_model import JointModel, check_extent, make_joint_model
from solvers.feedback.grid.player import FeedbackPlayer, Policy
from solvers.feedback.grid.single_agent import solve_single
from solvers.feedback.grid.state_grid import AXES

FINER = 0.8
"""Step of a response to a feedback policy, as a part of the step of that policy."""

MEMORY_LIMIT = 4e9
"""Default limit on bytes."""

OnProgress = Callable[[int, int], None]
"""Is called with the number of stages done, and their largest number."""


def feedback_optimum(
    game: Game,
    rules: Rules | None = None,
    *,
    step: float | None = None,
    memory_limit: float = MEMORY_LIMIT,
    time_limit: float | None = None,
    progress: OnProgress | None = None,
) -> FeedbackSolution:
    """Return feedback policies that minimise the sum of all agents' expected costs.

    Parameters
    ----------
    game, rules
        A game of two agents with up to two state components each, or of one agent with up to four;
        and the rules of play.
    step
        Distance between neighbouring positions of the grid; by default a quarter of the longest
        step of an agent, at most half of the tolerance.
    memory_limit
        Largest number of bytes; known before the work starts.
    time_limit
        Seconds after which the work ends with an error.
    progress
        Called after each stage with the number of stages done and their largest number.

    Raises
    ------
    InputError
        If the game does not fit on a grid, or a limit does not suffice.
    """
    if len(game.agents) == 1:
        return _single(game, rules, 0, (), step, memory_limit, time_limit, progress)
    model = make_joint_model(game, rules, step)
    return _solve("optimum", model, JointOptimum(model), memory_limit, time_limit, progress)


def feedback_equilibrium(
    game: Game,
    rules: Rules | None = None,
    *,
    start: str = "selfish",
    step: float | None = None,
    memory_limit: float = MEMORY_LIMIT,
    time_limit: float | None = None,
    progress: OnProgress | None = None,
) -> FeedbackSolution:
    """Return feedback policies of which neither agent has a better one, at any grid state.

    At each stage and joint state best responses alternate until neither changes.  They begin with
    the response of agent 1 to what agent 0 would do alone (``start="selfish"``), of agent 0 to
    what agent 1 would do alone (``swapped``), or of agent 1 at the pair of actions that minimises
    the sum of costs (``social``).  Where they cycle, the pair of least regret that was met is
    played.  Stages of the first half of the horizon begin with the actions of the stage after
    them, and the tolerance of a state grows each time that its actions change, so that policies
    become stationary.

    Costs are the agents' own.  Other parameters are those of :func:`feedback_optimum`.
    """
    require(start in STARTS, "start", f"is {start!r}", "write " + " or ".join(STARTS))
    model = make_joint_model(game, rules, step)
    _check_selfish(model)
    chooser = StageEquilibrium(model, start)
    return _solve("equilibrium", model, chooser, memory_limit, time_limit, progress)


def best_feedback_response(
    game: Game,
    agent: int,
    players: Sequence[Player],
    rules: Rules | None = None,
    *,
    step: float | None = None,
    memory_limit: float = MEMORY_LIMIT,
    time_limit: float | None = None,
    progress: OnProgress | None = None,
) -> FeedbackSolution:
    """Return the best feedback policy of ``agent`` against the others of ``players``.

    With two agents of up to two state components each, the policy observes both.  The other player
    may be of any kind whose actions depend on what it observes alone; it is asked
    at every joint grid state and time.  If it is a feedback policy from a grid, the default
    ``step`` is finer than that of its grid, so that its errors there are found.

    In other games all others must track plans, and the policy observes its own state, of up to
    four components: the others are met where their plans and the noise lead them.

    Other parameters are those of :func:`feedback_optimum`.
    """
    check_players(game, players)
    require(0 <= agent < len(players), "agent", f"is {agent}", "count agents from 0")
    if len(players) != 2 or any(mover.state_dim > AXES for mover in game.agents):
        return _single(game, rules, agent, players, step, memory_limit, time_limit, progress)
    other = players[1 - agent]
    if step is None and isinstance(other, FeedbackPlayer):
        step = FINER * other.policy.model.step
    model = make_joint_model(game, rules, step)
    _check_selfish(model)
    chooser = Response(model, agent, other)
    return _solve("response", model, chooser, memory_limit, time_limit, progress)


def _single(
    game: Game,
    rules: Rules | None,
    agent: int,
    players: Sequence[Player],
    step: float | None,
    memory_limit: float,
    time_limit: float | None,
    progress: OnProgress | None,
) -> FeedbackSolution:
    """Return the policy of an agent among players that follow plans, if there are others."""
    rules = (Rules() if rules is None else rules).of(game)
    check_extent(game, rules, alone=True)
    return solve_single(
        game, rules, agent, players, step=step, memory_limit=memory_limit, time_limit=time_limit,
        progress=progress,
    )  # fmt: skip


def _check_selfish(model: JointModel) -> None:
    require(
        model.rules.sharing == "selfish",
        "sharing",
        "is 'social'",
        "use 'selfish', or feedback_optimum for the sum of costs",
    )


def _solve(
    kind: str,
    model: JointModel,
    chooser: Chooser,
    memory_limit: float,
    time_limit: float | None,
    progress: OnProgress | None,
) -> FeedbackSolution:
    began = monotonic()
    needed = memory(model, chooser)
    stages = solve_backward(model, chooser, memory_limit, time_limit, progress)
    partner = chooser.player if isinstance(chooser, Response) else None
    without = chooser.without if isinstance(chooser, StageEquilibrium) else 0.0
    return FeedbackSolution(
        game=model.game,
        rules=model.rules,
        kind=kind,
        agents=chooser.agents,
        value=tuple(stages.start[i] for i in chooser.agents),
        step=model.step,
        stages=len(stages.choice),
        stationary=stages.stationary,
        without_equilibrium=without,
        memory=needed,
        seconds=monotonic() - began,
        policy=Policy(model, kind, stages, partner),
    )
