"""
A roundabout
============

Four robots cross a square with an island. No rule says on which side to pass; in this equilibrium
they agree.
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from ppg_env.plotting import draw_moment
from solvers import best_response_dynamics

game = make_game("../games/roundabout.toml")
solution = best_response_dynamics(game)
print(solution.status, "arrivals", solution.evaluation.arrival)

figure, panels = plt.subplots(
    1, 4, figsize=(10, 2.9), sharex=True, sharey=True, layout="constrained"
)
for axes, time in zip(panels.flat, (2, 4, 5, 7), strict=True):
    axes.set_xlim(-4.2, 4.2)
    axes.set_ylim(-4.2, 4.2)
    axes.set_aspect("equal")
    axes.set_title(f"t = {time}")
    draw_moment(axes, game, solution.profile, time)
