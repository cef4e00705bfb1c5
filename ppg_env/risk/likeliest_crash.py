r"""The likeliest crash of a profile: the noise of least norm that causes it, and the path it takes.

Let A be the likeliest event of the profile: with ``collisions="instants"`` the overlap at an
instant with the largest exact probability, with ``"swept"`` the overlap during a step with the
smallest reliability index.  In the space of all standard normals z, A first happens at its design
point (:mod:`ppg_env.risk.design_points`), at the distance beta from the origin:

    z* = argmin |z|  subject to A,      e(t) = -beta Cov(e(t), xi),

where xi is the standard normal along the half-space that touches the collision set.  The
deviations e(t) are the most probable path to the crash.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

from ppg_env.game.canonical import frame_of
from ppg_env.game.game import Game
from ppg_env.game.plan import Profile
from ppg_env.risk.crash_events import CrashModel, make_crash_model
from ppg_env.risk.design_points import (
    DesignPoint,
    design_point,
    likeliest_in_steps,
    paths_to,
)
from ppg_env.risk.union_bounds import RiskBounds, risk_bounds


@dataclass(frozen=True, eq=False)
class LikeliestCrash:
    """The most probable failure path; T the time of the crash, or of the end of its step.

    Attributes
    ----------
    encounter : index into ``game.encounters``.
    time, share : T, and the share of the step that ends at T; 1 at an instant.
    faces : faces of the collision set that the displacement touches: one, or those of a corner.
    normal : (d,) unit normal of the half-space that it enters.
    beta : reliability index; zero if the means overlap.
    deviations : per agent, (T+1, n) deviations of its states from the means.
    noise : per agent, (T, n) noise of each step; zeros for agents that take no part.
    obstacle : (T+1, d) deviations of the obstacle; None unless one moves with noise in it.
    log_probability : log of the exact probability of the overlap at T; None during a step.
    """

    encounter: int
    time: int
    share: float
    faces: tuple[int, ...]
    normal: np.ndarray
    beta: float
    deviations: tuple[np.ndarray, ...]
    noise: tuple[np.ndarray, ...]
    obstacle: np.ndarray | None
    log_probability: float | None

    @property
    def log_form(self) -> float:
        """Log of the first-order estimate Phi(-beta)."""
        return float(log_ndtr(-self.beta))


def likeliest_crash(
    game: Game, profile: Profile, bounds: RiskBounds | None = None
) -> LikeliestCrash | None:
    """Return the likeliest crash of the game's own event; None if no noise leads to one.

    ``bounds`` are those of the profile, if they are known.

    Raises
    ------
    InputError
        For the reasons of :func:`ppg_env.risk.union_bounds.risk_bounds`.
    """
    model = make_crash_model(game, profile, merge=False)
    if not len(game.encounters):
        return None
    covariances = model.processes.covariances(game.horizon)
    log_probability = None
    if model.swept:
        point = likeliest_in_steps(model, covariances)
    else:
        logs = (risk_bounds(game, profile) if bounds is None else bounds).log_instants
        e, t = (int(k) for k in np.unravel_index(int(logs.argmax()), logs.shape))
        log_probability = float(logs[e, t])
        point = None if np.isneginf(log_probability) else design_point(model, covariances, e, t)
    if point is None or point.half.level == np.inf:
        return None
    return _crash(game, model, covariances, point, log_probability)


def _crash(
    game: Game,
    model: CrashModel,
    covariances: np.ndarray,
    point: DesignPoint,
    log_probability: float | None,
) -> LikeliestCrash:
    half, processes, frame = point.half, model.processes, frame_of(game)
    T, beta = half.time, max(half.level, 0.0)
    N, d = len(game.agents), game.dim
    states = np.zeros((len(processes.loops), T + 1, processes.loops.shape[1]))
    if beta:
        path = -beta * paths_to(model, covariances, point)
        for side, s in enumerate(processes.parties[half.encounter]):
            if s >= 0:
                states[s] = path[: T + 1, side]
    steps = [_innovations(model, s, states[s]) for s in range(N)]
    units = [np.ones(agent.state_dim) for agent in game.agents] if frame is None else frame.states
    moving = processes.parties[half.encounter, 1] >= N
    other = states[processes.parties[half.encounter, 1], :, :d] * game.unit
    return LikeliestCrash(
        encounter=half.encounter,
        time=T,
        share=point.share,
        faces=point.faces,
        normal=half.normal,
        beta=beta,
        deviations=tuple(states[i, :, : len(u)] * u for i, u in enumerate(units)),
        noise=tuple(steps[i][:, : len(u)] * u for i, u in enumerate(units)),
        obstacle=other if moving else None,
        log_probability=log_probability,
    )


def _innovations(model: CrashModel, s: int, states: np.ndarray) -> np.ndarray:
    """Return (T, n) the noise of each step of a process; a resting one has none."""
    loop, moves = model.processes.loops[s], np.arange(len(states) - 1) < model.processes.rests[s]
    return np.where(moves[:, None], states[1:] - states[:-1] @ loop.T, 0.0)
