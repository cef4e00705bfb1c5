"""
An alcove
=========

Two robots exchange the ends of a corridor, and one waits in the alcove. Responses in turn need
not find plans at all here; the minimum of the potential plans both at once, and is an
equilibrium, too.
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from ppg_env.plotting import draw_moment
from solvers import potential_equilibrium

game = make_game("../games/alcove.toml")
solution = potential_equilibrium(game)
print(solution.status, "arrivals", solution.evaluation.arrival)

figure, panels = plt.subplots(2, 2, figsize=(8, 4.4), sharex=True, layout="constrained")
for axes, time in zip(panels.flat, (2, 4, 5, 8), strict=True):
    axes.set_xlim(-0.1, 5.1)
    axes.set_ylim(-0.1, 2.5)
    axes.set_aspect("equal")
    axes.set_title(f"t = {time}")
    draw_moment(axes, game, solution.profile, time)
