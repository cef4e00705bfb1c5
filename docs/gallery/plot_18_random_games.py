"""
Randomised games in the PettingZoo loop
=======================================

Every episode draws starts and the weight of time. The loop is the usual one; here, actions head
straight for the goals; lines end where agents arrive or crash.
"""

import matplotlib.pyplot as plt
import numpy as np

from ppg_env import parallel_env
from ppg_env.env import Near, Randomize, Uniform
from ppg_env.plotting import COLOURS

rule = Randomize(start=Near(15.0), lam=Uniform(0.2, 0.9), shared=("lam",))
env = parallel_env("intersection3", randomize=rule)

figure, axes = plt.subplots(figsize=(5, 4.6), layout="constrained")
for episode in range(20):
    env.reset(seed=episode)
    game, paths = env.simulator.game_of(), {name: [] for name in env.agents}
    while env.agents:
        actions = {}
        for name in env.agents:
            i = env.possible_agents.index(name)
            position = env.simulator.state[0, i]
            paths[name].append(position[:2].copy())
            actions[name] = np.clip(game.agents[i].goal - position, -10, 10)
        env.step(actions)
    for i, path in enumerate(paths.values()):
        axes.plot(*np.transpose(path), color=COLOURS[i], linewidth=0.8)
        axes.plot(*path[0], "o", color=COLOURS[i], markersize=4)
axes.set_aspect("equal")
axes.set_title("20 episodes; dots: where agents start")
