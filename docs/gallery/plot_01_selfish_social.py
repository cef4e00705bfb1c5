"""
Equilibrium next to optimum
===========================

Two agents meet head on. In the equilibrium each takes the shorter way for itself; in the social
optimum they keep a larger distance, since each crash harms both.
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from ppg_env.plotting import draw_profile
from solvers import potential_equilibrium, social_optimum

game = make_game("head_on", speed="l1", objective="risk", lam=0.8)
solutions = {"equilibrium": potential_equilibrium(game), "optimum": social_optimum(game)}

figure, panels = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True, layout="constrained")
for axes, (name, solution) in zip(panels, solutions.items(), strict=True):
    draw_profile(axes, game, solution.profile)
    evaluation = solution.evaluation
    axes.set_title(
        f"{name}: social cost {evaluation.social_cost:.2f},\n"
        f"crash probability at most {evaluation.risk_sum_any:.1e}"
    )
