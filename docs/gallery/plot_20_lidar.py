"""
What an agent sees
==================

With ``observation="lidar(rays=48)"`` an agent observes, along rays, the distance that it could
move before it would touch another body or an obstacle.
"""

import matplotlib.pyplot as plt
import numpy as np

from ppg_env import make_game, parallel_env
from ppg_env.plotting import draw_game

RAYS = 48
game = make_game("corridor(45)", speed="l1")
env = parallel_env(game, observation=f"lidar(rays={RAYS})")
observations, infos = env.reset(seed=1)
for _ in range(3):
    observations, *_ = env.step({name: np.array([10.0, 0.0]) for name in env.agents})

shares = observations["agent_0"][-RAYS:]  # of the lidar's reach, at most 1
reach = 2 * env.simulator.tables.scale
angles = 2 * np.pi * np.arange(RAYS) / RAYS
figure, axes = plt.subplots(figsize=(6.5, 5), layout="constrained")
draw_game(axes, game)
place = env.simulator.state[0, 0, :2]
ends = place + reach * shares[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
for end, share in zip(ends, shares, strict=True):
    axes.plot(*np.transpose([place, end]), color="0.6" if share == 1 else "#0072B2", linewidth=0.8)
axes.plot(*place, "o", color="#0072B2")
axes.set_xlim(-10, 110)
axes.set_ylim(0, 100)
axes.set_title("agent_0 after three steps; grey rays reach nothing")
