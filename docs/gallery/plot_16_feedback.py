"""
Plans with and without eyes
===========================

Twenty episodes of three kinds of players: agents that track their plans, agents that plan again
for everyone at each step, and learned policies. Thick lines are means.
"""

import matplotlib.pyplot as plt

from baselines import find_pretrained
from ppg_env import make_game
from ppg_env.env import track, trajectories
from ppg_env.plotting import draw_paths
from solvers import replanning, social_optimum

game = make_game("head_on", speed="l1", objective="risk", lam=0.8)
plans = social_optimum(game).profile
players = {
    "tracked plans": track(game, plans),
    "planned again at each step": replanning(game, plans, social=True),
    "learned": find_pretrained("ppo-social", game).players(game),
}

figure, panels = plt.subplots(1, 3, figsize=(11, 3.4), sharey=True, layout="constrained")
for axes, (name, team) in zip(panels, players.items(), strict=True):
    draw_paths(axes, game, trajectories(game, team, episodes=20, seed=1))
    axes.set_title(name)
