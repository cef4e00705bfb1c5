"""The environment under PettingZoo's names: ``parallel_env``, ``env`` (AEC) and ``raw_env``.

    from ppg_env import path_planning_v0

    env = path_planning_v0.parallel_env("head_on", speed="l1")

See :class:`ppg_env.env.parallel_env.PathPlanningEnv` for spaces, rewards and options.
"""

from __future__ import annotations

from typing import Any

from pettingzoo import AECEnv
from pettingzoo.utils import parallel_to_aec, wrappers

from ppg_env.env.parallel_env import PathPlanningEnv
from ppg_env.env.registration import parallel_env as make_parallel

__all__ = ["env", "parallel_env", "raw_env"]

parallel_env = PathPlanningEnv


def raw_env(*arguments: Any, **options: Any) -> AECEnv:
    """Return the environment as a turn-based (AEC) one; moves of a step take effect together.

    Options may be arguments of a family of games, as in ``raw_env("circle", n=8)``.
    """
    return parallel_to_aec(make_parallel(*arguments, **options))


def env(*arguments: Any, **options: Any) -> AECEnv:
    """Return :func:`raw_env` with PettingZoo's check of the order of calls."""
    return wrappers.OrderEnforcingWrapper(raw_env(*arguments, **options))
