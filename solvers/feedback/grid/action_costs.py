"""Expected costs of given actions, by one-step look-ahead on the fields of a solution.

Look-ahead players (:mod:`solvers.feedback.grid.player`) take the cheapest action; the difference to
its cost is what another action loses.  Costs leave out those of the step itself, which are the same
for all actions, but for effort.
"""

from __future__ import annotations

import numpy as np

from ppg_env.game.input_sets import set_at
from solvers.feedback.grid.action_kernels import price_alone, price_together
from solvers.feedback.grid.moves import after, project
from solvers.feedback.grid.player import Policy
from solvers.feedback.grid.state_grid import padded


class ActionCosts:
    """Costs of actions for an optimum, whose costs are those of both agents, or an equilibrium."""

    def __init__(self, policy: Policy) -> None:
        self._policy = policy

    def stage(self, clock: int) -> tuple[int, tuple[int, int]]:
        """Return what costs at ``clock`` depend on; equal values may be asked for at once."""
        return self._policy.row(clock), self._policy.model.epoch(clock)

    def alone(self, agent: int, states: np.ndarray, clock: int, actions: np.ndarray) -> np.ndarray:
        """Return the costs (C, K) of ``actions`` (C, K, m) of ``agent`` when the other has left.

        ``states`` (C, 2, n) are those of both; actions are projected on the control set.
        """
        policy, model, out = self._policy, self._policy.model, np.empty(actions.shape[:2])
        inputs = self._projected(agent, clock, actions)
        body = policy.body(agent, clock)._replace(share=1.0)
        alone = policy.stages.alone[agent][policy.row(clock)].reshape(model.grids[agent].shape)
        price_alone(body, model.harm(agent, clock), alone.astype(np.float64), model.risk,
                     self._padded(agent, states), inputs, out)  # fmt: skip
        return out

    def together(
        self, agent: int, states: np.ndarray, clock: int, actions: np.ndarray, other: np.ndarray
    ) -> np.ndarray:
        """Return the costs (C, K) of ``actions`` (C, K, m) of ``agent`` with both in traffic.

        The other agent takes the actions ``other`` (C, m).
        """
        policy, model, out = self._policy, self._policy.model, np.empty(actions.shape[:2])
        far = 1 - agent
        inputs = self._projected(agent, clock, actions)
        others = self._projected(far, clock, other[:, None])[:, 0]
        ends = after(model.game.agents[far], states[:, far], others)
        body = policy.body(agent, clock)
        size = np.ceil((body.span[1] - body.span[0]) / body.step).astype(int) + 5
        price_together(
            body, model.harm(agent, clock), policy.field_of(policy.row(clock), agent), agent == 0,
            model.risk, policy.crash()[agent], policy.body(far, clock), self._padded(agent, states),
            self._padded(far, states), ends, size, inputs, out,
        )  # fmt: skip
        return out

    def _projected(self, agent: int, clock: int, actions: np.ndarray) -> np.ndarray:
        mover = self._policy.model.game.agents[agent]
        inputs = actions[..., : mover.control_dim]
        flat = project(inputs.reshape(-1, mover.control_dim), set_at(mover.control, clock))
        return flat.reshape(inputs.shape)

    def _padded(self, agent: int, states: np.ndarray) -> np.ndarray:
        return padded(states[:, agent, : self._policy.model.game.agents[agent].state_dim])
