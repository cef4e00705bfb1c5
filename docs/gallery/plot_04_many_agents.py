"""
Ten agents change places
========================

All straight paths meet in the centre. The equilibrium is certified: no agent can gain by another
plan while the others keep theirs.
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from ppg_env.plotting import draw_moment
from solvers import best_response_dynamics

game = make_game("circle(10)")
solution = best_response_dynamics(game)

figure, panels = plt.subplots(1, 3, figsize=(10, 3.6), sharey=True, layout="constrained")
for axes, time in zip(panels, (3, 6, 9), strict=True):
    axes.set_xlim(-72, 72)
    axes.set_ylim(-72, 72)
    axes.set_aspect("equal")
    axes.set_title(f"t = {time}")
    draw_moment(axes, game, solution.profile, time)
figure.suptitle(f"{solution.status}: social cost {solution.evaluation.social_cost:.1f}")
