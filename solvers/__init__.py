"""Planners: best responses, Nash equilibria, social optima, and certificates.

Names are loaded when first used, because cvxpy takes a second to import.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from solvers.certificate import Certificate, certify
    from solvers.collection import Equilibrium, collect_equilibria
    from solvers.dynamics import best_response_dynamics
    from solvers.joint import potential_equilibrium, social_optimum
    from solvers.response import best_response
    from solvers.solution import Solution, Status

_HOMES = {
    "best_response": "response",
    "best_response_dynamics": "dynamics",
    "Certificate": "certificate",
    "certify": "certificate",
    "collect_equilibria": "collection",
    "Equilibrium": "collection",
    "potential_equilibrium": "joint",
    "social_optimum": "joint",
    "Solution": "solution",
    "Status": "solution",
}

__all__ = [
    "Certificate",
    "Equilibrium",
    "Solution",
    "Status",
    "best_response",
    "best_response_dynamics",
    "certify",
    "collect_equilibria",
    "potential_equilibrium",
    "social_optimum",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
