"""A trained player in the loop of PettingZoo: one observation in, one action out."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest

from baselines import read_learned
from baselines.pretrained import find_pretrained
from ppg_env import InputError, make_game, parallel_env
from ppg_env.support.read_file import MIB


def test_pretrained_players_arrive_in_the_loop():
    game = make_game("head_on", speed="l1", objective="risk", lam=0.8)
    players = find_pretrained("ppo-social", game)
    policies = {name: players.policy(game, name) for name in game.agent_names}
    env = parallel_env(game)
    observations, _ = env.reset(seed=1)
    arrived = {}
    while env.agents:
        actions = {name: policies[name](observations[name]) for name in env.agents}
        observations, _, _, _, infos = env.step(actions)
        arrived |= {name: bool(infos[name]["arrived"]) for name in infos}
    assert all(arrived.values())


def test_an_action_is_that_of_the_batched_player():
    game = make_game("head_on", speed="l1", objective="risk", lam=0.8)
    players = find_pretrained("ppo-selfish", game)
    observations = np.random.default_rng(0).normal(size=(20, 60)).astype(np.float32)
    player = players.players(game, 1)[1]
    batch = player.actions(observations, np.full(20, 0.8))
    alone = players.policy(game, 1, run=1)
    for observation, action in zip(observations, batch, strict=True):
        np.testing.assert_allclose(alone(observation), action, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("agent", ["agent_9", 2, -1, None])
def test_an_unknown_agent_is_refused(agent):
    game = make_game("head_on", speed="l1", objective="risk", lam=0.8)
    with pytest.raises(InputError, match="write agent_0 or agent_1"):
        find_pretrained("ppo-social", game).policy(game, agent)


def test_a_file_that_unpacks_to_gigabytes_is_refused_before_it_is_unpacked(tmp_path):
    header = io.BytesIO()
    np.lib.format.write_array(header, np.zeros(0, dtype=np.uint8))
    path = tmp_path / "bomb.npz"
    zeros = bytes(MIB)
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("about.npy", "w", force_zip64=True) as stream,
    ):
        stream.write(header.getvalue())
        for _ in range(300):
            stream.write(zeros)
    assert path.stat().st_size < 2 * MIB
    with pytest.raises(InputError, match="unpacks to 300 MiB, more than 256"):
        read_learned(path)
