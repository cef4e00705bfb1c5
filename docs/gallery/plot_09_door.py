"""
A door for one
==============

Two robots with bounded accelerations change rooms. The equilibrium decides who waits. Dark bodies
are where they are, pale areas are what they touched in the step before, and means stay within the
dotted line.
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from ppg_env.plotting import draw_moment
from solvers import best_response_dynamics

game = make_game("../games/door.toml")
solution = best_response_dynamics(game)
print(solution.status, "arrivals", solution.evaluation.arrival)

figure, panels = plt.subplots(
    1, 4, figsize=(10, 2.6), sharex=True, sharey=True, layout="constrained"
)
for axes, time in zip(panels.flat, (2, 4, 6, 8), strict=True):
    axes.set_xlim(-0.2, 6.2)
    axes.set_ylim(-0.2, 4.2)
    axes.set_aspect("equal")
    axes.set_title(f"t = {time}")
    draw_moment(axes, game, solution.profile, time)
