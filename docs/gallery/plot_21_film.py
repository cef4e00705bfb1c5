"""
A film of an episode
====================

``env.render()`` returns frames, and ``write_gif`` writes them to a file. Four of the frames:
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt

from ppg_env import make_game, parallel_env
from ppg_env.env import write_gif
from solvers import social_optimum

game = make_game("intersection3", speed="l1")
plans = social_optimum(game).profile
env = parallel_env(game, render_mode="rgb_array")
env.reset(seed=1)
frames = [env.render()]
for t in range(game.horizon):
    if env.agents:
        env.step({name: plans[int(name[-1])].controls[t] for name in env.agents})
        frames.append(env.render())

with TemporaryDirectory() as folder:  # name a file of your own
    write_gif(frames, f"{folder}/episode.gif")
    print(len(frames), "frames,", Path(folder, "episode.gif").stat().st_size // 1000, "kB")

figure, panels = plt.subplots(1, 4, figsize=(11, 3), layout="constrained")
for axes, t in zip(panels, (0, 3, 5, 8), strict=True):
    axes.imshow(frames[t])
    axes.axis("off")
