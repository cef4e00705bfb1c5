"""PettingZoo ids, so that ``pettingzoo.make("parallel", "ppg/opposing-v0")`` finds the games."""

from __future__ import annotations

from ppg_env.scenarios.registry import registry


def register_environments() -> None:
    """Register every scenario with PettingZoo; releases without a registry are skipped."""
    try:
        from pettingzoo import parallel_registry, register
    except ImportError:  # before 1.27
        return
    for name in registry():
        if f"ppg/{name}-v0" not in parallel_registry:
            register(
                "parallel",
                f"ppg/{name}-v0",
                entry_point="ppg_env.path_planning_v0:parallel_env",
                kwargs={"game": name},
            )
