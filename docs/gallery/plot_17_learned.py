"""
Selfish and social learners
===========================

Expected cost and crash probability of learned players next to planned ones, from the same noise.
The learners differ in their reward alone: their own, or the sum of all.
"""

import matplotlib.pyplot as plt

from baselines import find_pretrained
from ppg_env import make_game
from ppg_env.env import evaluate, track
from solvers import potential_equilibrium, social_optimum

game = make_game("head_on", speed="l1", objective="risk", lam=0.8)
teams = {
    "equilibrium": track(game, potential_equilibrium(game).profile),
    "optimum": track(game, social_optimum(game).profile),
    "ppo-selfish": find_pretrained("ppo-selfish", game).players(game),
    "ppo-social": find_pretrained("ppo-social", game).players(game),
}

figure, axes = plt.subplots(figsize=(6.5, 3.6), layout="constrained")
for (name, players), marker in zip(teams.items(), "os^v", strict=True):
    summary = evaluate(game, players, episodes=20_000, seed=1).summary()
    crash, cost = summary.crash_any, summary.cost_mean
    axes.errorbar(
        crash.value,
        cost.value,
        xerr=[[crash.value - crash.low], [crash.high - crash.value]],
        yerr=[[cost.value - cost.low], [cost.high - cost.value]],
        marker=marker,
        label=name,
    )
axes.set_xscale("log")
axes.set_xlabel("crash probability")
axes.set_ylabel("expected cost per agent")
axes.legend()
