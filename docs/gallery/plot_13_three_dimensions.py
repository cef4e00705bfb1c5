"""
Three agents in space
=====================

One agent along each axis; all would meet in the middle. Games in space use the same functions.
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from ppg_env.plotting import COLOURS
from solvers import potential_equilibrium

game = make_game("intersection_3d")
solution = potential_equilibrium(game)

figure = plt.figure(figsize=(6, 5.5))
axes = figure.add_subplot(projection="3d")
for i, (agent, plan) in enumerate(zip(game.agents, solution.profile, strict=True)):
    path = plan.means[: plan.arrival + 1, :3]
    axes.plot(*path.T, ".-", color=COLOURS[i], label=f"{game.agent_names[i]}, T = {plan.arrival}")
    axes.plot(*agent.goal[:3], "*", color=COLOURS[i], markersize=12)
axes.set_xlabel("x")
axes.set_ylabel("y")
axes.set_zlabel("z")
axes.legend(loc="upper left")
