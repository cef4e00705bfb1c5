"""Networks of experts: what they choose, what is exported, and what training may change."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from baselines import Learned, Policy, imitation, read_learned, write_learned
from baselines.export import export_policy, mean_action
from baselines.ppo import make_learner
from baselines.training_loop import Args, Learner, one_thread
from ppg_env import Game, InputError
from ppg_env.formats.game_file import game_to_tables


@pytest.fixture
def learner(game: Game) -> Learner:
    return make_learner(Args(game, lam=None, steps=64, imitate_feedback=True), copies=8)


def test_the_largest_gate_chooses_the_action() -> None:
    weights = np.array([[1.0], [-1.0], [0.0], [0.0], [0.0], [0.0]])
    biases = np.array([0.0, 0.0, 0.1, 0.2, 0.3, 0.4])
    policy = Policy((weights,), (biases,), experts=2)
    assert policy.outputs == 2
    chosen = policy(np.array([[2.0], [-2.0]], dtype=np.float32))
    np.testing.assert_allclose(chosen, [[0.1, 0.2], [0.3, 0.4]], rtol=1e-6)


def test_gates_without_actions_are_refused() -> None:
    with pytest.raises(InputError, match="do not fit together"):
        Policy((np.zeros((7, 1)),), (np.zeros(7),), experts=3)


def test_an_exported_network_plays_what_it_plays_in_training(learner: Learner) -> None:
    inputs = np.random.default_rng(0).normal(size=(500, 9)).astype(np.float32)
    with torch.no_grad():
        expected = mean_action(learner.model, torch.as_tensor(inputs)).numpy()
    policy = export_policy(learner.model)
    assert (policy.experts, policy.outputs) == (3, 2)
    np.testing.assert_allclose(policy(inputs), np.clip(expected, -1, 1), atol=1e-5)


def test_files_keep_experts_and_earlier_releases_refuse_them(
    game: Game, learned: Learned, learner: Learner, tmp_path: Path
) -> None:
    policy = export_policy(learner.model)
    about = learned.about | {"game": game_to_tables(game)}
    path = write_learned(tmp_path / "experts.npz", Learned(((policy,),), about))
    assert read_learned(path).runs == ((policy,),)
    with np.load(path) as arrays:
        assert '"version": 2' in str(arrays["about"])


@one_thread()
def test_experts_represent_a_jump(learner: Learner, monkeypatch: pytest.MonkeyPatch) -> None:
    """A least-squares fit of one continuous network takes means near the jump."""
    random = np.random.default_rng(0)
    inputs = random.uniform(-1, 1, (4000, 9)).astype(np.float32)
    targets = np.where(inputs[:, :1] > 0.2, [[0.8, -0.5]], [[-0.3, 0.6]]).astype(np.float32)
    layers = learner.model.policy.parameters()
    optimiser = torch.optim.Adam(layers, lr=imitation.RATE)
    monkeypatch.setattr(imitation, "BATCH", 256)
    imitation._fit(
        learner.model, optimiser, *map(torch.as_tensor, (inputs, targets)), 1500, True, random
    )
    error = np.abs(export_policy(learner.model)(inputs) - targets).max(axis=1)
    between = (error > 0.2) & (error < 0.9)
    assert between.mean() < 0.002
    assert (error < 0.2).mean() > 0.97


def test_policy_gradients_leave_gates_as_they_are(learner: Learner) -> None:
    inputs = np.random.default_rng(0).normal(size=(500, 9)).astype(np.float32)
    before = export_policy(learner.model)
    with one_thread():
        learner.model.learn(learner.rollout)
    after = export_policy(learner.model)
    for k in range(2):
        np.testing.assert_array_equal(before.weights[k], after.weights[k])
    np.testing.assert_array_equal(before.weights[2][:3], after.weights[2][:3])
    assert np.abs(before(inputs) - after(inputs)).max() > 0
