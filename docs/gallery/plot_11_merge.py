"""
Merge next to a truck
=====================

A lane ends, and two cars merge with a truck that keeps its course: an obstacle on a path, whose
position becomes more uncertain over time.
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from ppg_env.plotting import draw_moment
from solvers import best_response_dynamics

game = make_game("../games/merge.toml")
solution = best_response_dynamics(game)

figure, panels = plt.subplots(4, 1, figsize=(8, 6), layout="constrained")
for axes, time in zip(panels, (2, 4, 6), strict=False):
    axes.set_xlim(-12, 72)
    axes.set_ylim(0, 7)
    axes.set_aspect("equal")
    axes.set_title(f"t = {time}")
    draw_moment(axes, game, solution.profile, time)
for margins, encounter in zip(solution.evaluation.margins, game.encounters, strict=True):
    others = [game.agent_names[i] for i in encounter.agents]
    if encounter.obstacle is not None:
        others.append(
            "the truck" if game.obstacles[encounter.obstacle].path is not None else "lane"
        )
    panels[3].plot(margins[:-1], ".-", label=" and ".join(others))
panels[3].set_xlabel("step")
panels[3].set_ylabel("margin")
panels[3].legend()
