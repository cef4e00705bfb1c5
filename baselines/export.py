"""Export a stable-baselines3 model to plain arrays."""

from __future__ import annotations

from typing import Any

import torch
from torch import nn

from baselines.experts import Experts
from baselines.policy import Policy
from ppg_env.env.drawn_entries import observed_fields
from ppg_env.env.randomize import Randomize
from ppg_env.errors import require

ACTIVATIONS = {nn.Tanh: "tanh", nn.ReLU: "relu"}


def export_policy(
    model: Any, *, conditioned: bool = False, randomize: Randomize | None = None
) -> Policy:
    """Return the policy of a PPO, A2C or SAC model with ``MlpPolicy``, without exploration.

    ``conditioned`` states that lam is the last input, as in a
    :class:`~baselines.vec_env.GameVecEnv` with ``weights``; ``randomize`` is its rule.

    Raises
    ------
    InputError
        If a wrapper normalises observations, or the network is not fully connected.
    """
    normalised = model.get_vec_normalize_env()
    require(
        normalised is None or not normalised.norm_obs,
        "model",
        "sees observations that VecNormalize rescales",
        "train it with norm_obs=False; the environment's observations are scaled already",
    )
    layers = actor_layers(model)
    hidden = {type(layer) for layer in layers if not isinstance(layer, nn.Linear)}
    require(
        len(hidden) == 1 and next(iter(hidden)) in ACTIVATIONS,
        "model",
        "has a network that cannot be exported",
        "use fully connected layers with one activation, tanh or relu",
    )
    linear = [layer for layer in layers if isinstance(layer, nn.Linear)]
    return Policy(
        tuple(layer.weight.detach().numpy() for layer in linear),
        tuple(layer.bias.detach().numpy() for layer in linear),
        ACTIVATIONS[next(iter(hidden))],
        squash=hasattr(model, "actor"),
        conditioned=conditioned,
        drawn=observed_fields(randomize),
        shared=() if randomize is None else randomize.shared,
        experts=linear[-1].experts if isinstance(linear[-1], Experts) else 1,
    )


def actor_layers(model: Any) -> list[nn.Module]:
    """Return the layers from observation to mean action; those of SAC end before its tanh."""
    if hasattr(model, "actor"):
        return [*model.actor.latent_pi, model.actor.mu]
    return [*model.policy.mlp_extractor.policy_net, model.policy.action_net]


def candidates(model: Any, inputs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the gates (C, K) and the actions (C, K, m) of all experts, for inputs (C, W)."""
    layers: list[Any] = actor_layers(model)
    for layer in layers[:-1]:
        inputs = layer(inputs)
    gates, actions = layers[-1].candidates(inputs)
    return gates, actions


def mean_action(model: Any, inputs: torch.Tensor) -> torch.Tensor:
    """Return the mean action of inputs (C, W), before clipping or tanh."""
    for layer in actor_layers(model):
        inputs = layer(inputs)
    return inputs
