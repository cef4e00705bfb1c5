"""
Probabilities too small to count
================================

As agents weigh safety more, crashes become too rare for 100,000 episodes. Importance sampling
estimates them from as many episodes, and stays below the proved bound.
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from ppg_env.risk import crash_counts, rare_risk, risk_bounds
from solvers import social_optimum

lams = 0.9, 0.7, 0.5, 0.3, 0.1
figure, axes = plt.subplots(figsize=(6.5, 3.8), layout="constrained")
for lam in lams:
    game = make_game("intersection3", speed="l1", lam=lam, margin_cap=6)
    profile = social_optimum(game, time_limit=2).profile
    counted = crash_counts(game, profile, samples=100_000, seed=1)
    rare = rare_risk(game, profile, samples=100_000, seed=1).any
    bound = risk_bounds(game, profile).any.least
    share = counted.first_any.sum() / counted.samples
    axes.plot(lam, bound, "_", color="black", markersize=16)
    axes.plot([lam, lam], [rare.low, rare.high], color="#0072B2", linewidth=3)
    if share:
        axes.plot(lam, share, "o", color="#D55E00", markerfacecolor="none")
axes.set_yscale("log")
axes.set_xlabel("lam, the weight of time")
axes.set_ylabel("crash probability")
axes.legend(["proved bound", "importance sampling (95 %)", "counted"])
