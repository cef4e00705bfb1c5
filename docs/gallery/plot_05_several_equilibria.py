"""
Several equilibria
==================

Best responses from different starts end in different equilibria. Their names say who passes whom
on which side; their costs over the optimum's are prices of anarchy and of stability among those
found.
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from ppg_env.plotting import draw_profile
from solvers import collect_equilibria, social_optimum

game = make_game("intersection", speed="l1", objective="risk", lam=0.8)
equilibria = collect_equilibria(game, runs=8, seed=1)
optimum = social_optimum(game).evaluation.social_cost

figure, panels = plt.subplots(
    1, len(equilibria), figsize=(4.2 * len(equilibria), 4), squeeze=False, layout="constrained"
)
for axes, equilibrium in zip(panels[0], equilibria, strict=True):
    draw_profile(axes, game, equilibrium.solution.profile)
    price = equilibrium.solution.evaluation.social_cost / optimum
    axes.set_title(f"{equilibrium.name} ({equilibrium.found} of 8 runs)\nprice {price:.3f}")
