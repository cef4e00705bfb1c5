"""
A film of an episode
====================

``env.render()`` returns frames. Here matplotlib plays them; ``ppg_env.env.write_gif`` writes them
to a file.
"""

import matplotlib.pyplot as plt
from matplotlib.animation import FuncAnimation

from ppg_env import make_game, parallel_env
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

figure, axes = plt.subplots(figsize=(4.5, 4.5), layout="constrained")
axes.axis("off")
picture = axes.imshow(frames[0])
film = FuncAnimation(figure, lambda k: [picture.set_data(frames[k])], len(frames), interval=300)
