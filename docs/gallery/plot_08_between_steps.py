"""
Margins between the steps
=========================

The paper looks at time steps only. Two robots may then pass through each other between two of
them (the crosses). With ``collisions="swept"`` bodies keep apart during the steps, too, and one
robot waits.
"""

import matplotlib.pyplot as plt

from ppg_env import make_game
from ppg_env.game import overlaps_between_steps
from ppg_env.plotting import draw_profile
from solvers import best_response_dynamics

figure, panels = plt.subplots(1, 2, figsize=(10, 3.8), sharey=True, layout="constrained")
for axes, rule in zip(panels, ("instants", "swept"), strict=True):
    game = make_game("../games/door.toml", collisions=rule)
    profile = best_response_dynamics(game).profile
    draw_profile(axes, game, profile)
    axes.set_title(f"{rule}: arrivals at {profile[0].arrival} and {profile[1].arrival}")
    print(rule, *overlaps_between_steps(game, profile))
