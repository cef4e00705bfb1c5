"""Crash probabilities of plans: exact for each instant, and certified bounds over time."""

from ppg_env.risk.bounds import Bounds, RiskBounds, risk_bounds
from ppg_env.risk.overlap import log_overlap

__all__ = ["Bounds", "RiskBounds", "log_overlap", "risk_bounds"]
