"""Receding-horizon players for the environment.

Every few steps, a player solves its best response from the observed state.  It predicts that the
other agents follow their initial plans, that their deviations shrink by their gains, and that
moving obstacles keep their distance from their paths.  Agents that have left are ignored; parked
ones are obstacles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ppg_env.env.players import GoToGoal, Player, Tracker, View
from ppg_env.errors import InputError, require
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.input_sets import later
from ppg_env.game.objective import selfish
from ppg_env.game.obstacle import Obstacle
from ppg_env.game.plan import Plan, Profile
from ppg_env.support.frozen import frozen_array
from solvers.budget import Budget
from solvers.dispatch import ENGINE, minimise


class RecedingHorizon:
    """A player that replans every ``every`` steps and tracks its plan in between.

    Each copy solves one mixed-integer program per decision, so this is for hundreds of episodes.
    If no plan is found in ``time_limit`` seconds, the last plan stays in use.

    Parameters
    ----------
    game, agent, profile
        The game, the index of the player's agent, and the plans expected of all agents.
    every
        Steps between two plans, 1 or more.
    """

    information = "full state"

    def __init__(
        self,
        game: Game,
        agent: int,
        profile: Profile,
        *,
        every: int = 3,
        solver: str = ENGINE,
        time_limit: float | None = 5.0,
    ) -> None:
        require(every >= 1, "every", f"is {every}", "plan at least every step")
        self._game, self._agent, self._profile = game, agent, profile
        self._every, self._solver, self._limit = every, solver, time_limit
        self._go_to_goal, self._tracker = (
            GoToGoal(game, agent),
            Tracker(game, agent, profile[agent]),
        )
        self._plans: dict[int, tuple[int, Plan]] = {}

    def act(self, view: View) -> np.ndarray:
        """Return actions (C, m); copies whose turn it is replan first."""
        action = self._tracker.act(view)
        for copy in np.flatnonzero(view.in_traffic[:, self._agent]).tolist():
            t = int(view.clock[copy])
            if t == 0:
                self._plans.pop(copy, None)
            elif t % self._every == 0:
                self._replan(copy, t, view)
            if copy in self._plans:
                action[copy] = self._follow(copy, t, view)
        return action

    def _follow(self, copy: int, t: int, view: View) -> np.ndarray:
        """Return the action (m,) of one copy at step ``t`` under its last plan."""
        planned_at, plan = self._plans[copy]
        mover = self._game.agents[self._agent]
        state = view.state[copy, self._agent, : mover.state_dim]
        step = t - planned_at
        if plan.arrival is None or step >= plan.arrival:
            return self._go_to_goal.towards_goal(state[None], view.clock[[copy]])[0]
        return plan.controls[step] - mover.gain @ (state - plan.means[step])

    def _replan(self, copy: int, t: int, view: View) -> None:
        """Store the best response of one copy from its states at step ``t``, if there is one."""
        game, left = self._game, max(self._game.horizon - t, 1)
        movers = np.flatnonzero(view.in_traffic[copy]).tolist()
        agents, plans = [], []
        for i in movers:
            agent = game.agents[i]
            state = view.state[copy, i, : agent.state_dim]
            agents.append(self._agent_now(agent, state, t, own=i == self._agent))
            plans.append(self._predicted(i, state, t, left))
        obstacles, own = self._obstacles_now(copy, t, view), movers.index(self._agent)
        for horizon in (left, game.horizon):  # a late agent gets the whole horizon again
            try:
                now = replace(game, agents=tuple(agents), obstacles=obstacles, horizon=horizon)
            except InputError:  # bodies overlap already
                return
            given = tuple(_stretched(plan, horizon) for plan in plans)
            own_cost, budget = selfish(now, own), Budget(self._limit)
            response = minimise(own_cost, (own,), given, self._solver, budget)
            if response.profile is not None:
                self._plans[copy] = (t, response.profile[own])
                return

    def _agent_now(self, agent: Agent, state: np.ndarray, t: int, *, own: bool) -> Agent:
        """Return an agent as it starts at step ``t``, its state known.

        A state that has left the workspace widens it up to there; others' plans need none.
        """
        within = tuple(
            replace(
                region, offsets=np.maximum(region.offsets, region.normals @ state[: region.dim])
            )
            for region in agent.within
            if own
        )
        return replace(
            agent,
            start=state,
            control=later(agent.control, t),
            sigma0=np.zeros_like(agent.sigma0),
            within=within,
        )

    def _obstacles_now(self, copy: int, t: int, view: View) -> tuple[Obstacle, ...]:
        """Return the obstacles with time counted from ``t``, and parked agents as obstacles.

        A moving obstacle is expected to keep its present distance from its path.
        """
        obstacles, positions = [], iter(view.obstacles[copy])
        for obstacle in self._game.obstacles:
            if obstacle.path is None:
                path = None
            else:
                ahead = obstacle.path[min(t, obstacle.rest) :]
                path = ahead + (next(positions) - ahead[0])
            until = None if obstacle.until is None else obstacle.until - t
            if until is None or until >= 1:
                obstacles.append(replace(obstacle, path=path, until=until))
        for i in np.flatnonzero(view.parked[copy]):
            position = view.state[copy, i, : self._game.dim]
            obstacles.append(Obstacle(self._game.agents[i].shape, position[None]))
        return tuple(obstacles)

    def _predicted(self, i: int, state: np.ndarray, t: int, steps: int) -> Plan:
        """Return the means of agent i if it follows its plan and gain from ``state`` at t."""
        agent, plan = self._game.agents[i], self._profile[i]
        means, error = (
            np.empty((steps + 1, agent.state_dim)),
            state - plan.means[min(t, self._game.horizon)],
        )
        for k in range(steps + 1):
            means[k] = plan.means[min(t + k, self._game.horizon)] + error
            error = agent.closed_loop @ error
        end = self._game.horizon if plan.arrival is None else plan.arrival
        return Plan(
            frozen_array(np.zeros((steps, agent.control_dim))),
            frozen_array(means),
            max(end - t, 1),
        )


def _stretched(plan: Plan, horizon: int) -> Plan:
    """Return ``plan`` with its last mean repeated up to ``horizon``."""
    missing = horizon + 1 - len(plan.means)
    if missing <= 0:
        return plan
    means = np.vstack([plan.means, np.repeat(plan.means[-1:], missing, axis=0)])
    controls = np.zeros((horizon, plan.controls.shape[1]))
    return Plan(frozen_array(controls), frozen_array(means), plan.arrival)


def receding_horizon(
    game: Game, profile: Profile, *, every: int = 3, solver: str = ENGINE
) -> Sequence[Player]:
    """Return a :class:`RecedingHorizon` player per agent, all of which expect ``profile``."""
    return [
        RecedingHorizon(game, i, profile, every=every, solver=solver)
        for i in range(len(game.agents))
    ]
