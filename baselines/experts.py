r"""Networks of several experts: each proposes an action, and gates choose one of them.

    (g_1 ... g_K, a_1 ... a_K) = W x + b        x: the last hidden layer
    action = a_k, k the expert of the largest gate g_k

A network without experts is continuous.  Where a good action changes abruptly, as on the border
between going first and giving way, it takes the mean of both, which may be worse than either.
"""

from __future__ import annotations

from typing import Any

import torch
from stable_baselines3.common.distributions import Distribution
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.preprocessing import get_action_dim
from torch import nn


class Experts(nn.Linear):
    """Last layer of a policy: ``experts`` gates, and as many actions of ``size`` entries."""

    def __init__(self, inputs: int, size: int, experts: int) -> None:
        super().__init__(inputs, experts * (1 + size))
        self.experts = experts

    def candidates(self, inputs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the gates (C, K) and the actions (C, K, m) of all experts."""
        outputs = super().forward(inputs)
        gates, actions = outputs[:, : self.experts], outputs[:, self.experts :]
        return gates, actions.reshape(len(outputs), self.experts, -1)

    def forward(self, inputs: torch.Tensor) -> torch.Tensor:
        """Return the chosen actions (C, m)."""
        gates, actions = self.candidates(inputs)
        return actions[torch.arange(len(actions)), gates.argmax(dim=1)]


class ExpertPolicy(ActorCriticPolicy):
    """Actor and critic of stable-baselines3, with experts in the actor's last layer.

    Policy gradients change the experts' actions, and neither the gates nor what these see: the
    choice of an expert is not random, and has no gradient.
    """

    def __init__(self, *args: Any, experts: int, **options: Any) -> None:
        self._experts = experts
        super().__init__(*args, **options)

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        size = get_action_dim(self.action_space)
        self.action_net = Experts(self.mlp_extractor.latent_dim_pi, size, self._experts)
        options = {"lr": lr_schedule(1), **self.optimizer_kwargs}
        self.optimizer = self.optimizer_class(self.parameters(), **options)

    def _get_action_dist_from_latent(self, latent_pi: torch.Tensor) -> Distribution:
        return super()._get_action_dist_from_latent(latent_pi.detach())
