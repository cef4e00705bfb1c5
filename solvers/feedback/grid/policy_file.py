"""Files of feedback policies: NumPy arrays and a JSON text, without code.

    about                       JSON: format, version, kind, game, rules, step, value, ...
    fields, choice              the stages of :class:`solvers.feedback.grid.backward.Stages`
    alone<i>, passing<i>        the same for agent i alone, and while the other one is parked

Grids, noise and collisions are computed again from the game when a file is read.
"""

from __future__ import annotations

import io
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ppg_env.env.rules import make_rules
from ppg_env.errors import InputError, require
from ppg_env.formats.game_file import game_from_tables, game_to_tables
from ppg_env.formats.plan_file import to_json
from ppg_env.support.archives import about_json, opened_archive
from ppg_env.support.atomic_write import write_atomically
from ppg_env.support.read_file import MIB
from solvers.feedback.grid.backward import Stages
from solvers.feedback.grid.feedback_solution import FeedbackSolution
from solvers.feedback.grid.joint_model import make_joint_model
from solvers.feedback.grid.player import Policy

FORMAT = "path-planning-games/feedback"
VERSION = 1
REMEDY = "give a file that write_feedback wrote"

LARGEST = 4096 * MIB
"""Bytes of all arrays of a file: stages of a fine grid."""

FIGURES = ("kind", "agents", "value", "step", "stationary", "without_equilibrium", "memory")
"""Attributes of a solution that are written as they are."""


def write_feedback(path: str | Path, solution: FeedbackSolution, *, last: bool = False) -> Path:
    """Save an optimum or an equilibrium as an .npz file.

    With ``last``, a stationary solution is saved as its last stage, which then stands for all.

    Raises
    ------
    InputError
        If the solution is a response: it needs the player that it responds to.
    """
    require(solution.kind != "response", "solution", "is a response", "save the player's actions")
    policy = solution.policy
    if not isinstance(policy, Policy):
        raise InputError("solution", "is of one agent alone", "solve the game again where needed")
    stages = policy.stages
    kept = slice(-1 if last and solution.stationary else None, None)
    arrays: dict[str, Any] = {f"alone{i}": values[kept] for i, values in stages.alone.items()}
    arrays |= {f"passing{i}": values[kept] for i, values in stages.passing.items()}
    figures = {name: getattr(solution, name) for name in FIGURES}
    about = {
        "format": FORMAT,
        "version": VERSION,
        "game": game_to_tables(solution.game),
        "rules": asdict(solution.rules),
        "seconds": round(solution.seconds, 3),
        **figures,
    }
    content = io.BytesIO()
    np.savez_compressed(
        content, about=np.array(to_json(about)), fields=stages.fields[kept],
        choice=stages.choice[kept], **arrays,
    )  # fmt: skip
    return write_atomically(path, content.getvalue())


def read_feedback(path: str | Path) -> FeedbackSolution:
    """Load a feedback solution; no code of the file is run.

    Raises
    ------
    InputError
        If the file is missing, was not written by :func:`write_feedback`, or is damaged.
    """
    with opened_archive(path, REMEDY, LARGEST) as arrays:
        return _solution(str(path), about_json(arrays), arrays)


def is_feedback(path: str | Path) -> bool:
    """Return whether a file says that it holds feedback policies; it may still be damaged."""
    try:
        with opened_archive(path, REMEDY, LARGEST) as arrays:
            return f'"{FORMAT}"' in str(arrays["about"])
    except InputError:
        return False


def _solution(source: str, about: Any, arrays: Any) -> FeedbackSolution:
    """Return the solution in a file; errors of all kinds pass through."""
    known = isinstance(about, dict) and about.get("format") == FORMAT
    require(known, source, "is not a file of feedback policies", REMEDY)
    require(
        about.get("version") == VERSION,
        source,
        f"has version {about.get('version')!r:.40}",
        f"solve again with this release, which reads version {VERSION}",
    )
    game = game_from_tables(about["game"], "game")
    model = make_joint_model(game, make_rules(game, **about["rules"]), float(about["step"]))
    fields, choice = arrays["fields"], arrays["choice"]
    agents = tuple(int(i) for i in about["agents"])
    alone = {i: arrays[f"alone{i}"] for i in agents}
    passing = {i: arrays[f"passing{i}"] for i in agents if model.risk.parks}
    fits = fields.shape[2:] == choice.shape[2:] == model.shape and choice.shape[1] == 2
    fits = fits and len(fields) == len(choice) and choice.max() < model.most_actions
    require(fits, source, "does not fit its game", REMEDY)
    stationary = bool(about["stationary"])
    return FeedbackSolution(
        game=model.game,
        rules=model.rules,
        kind=str(about["kind"]),
        agents=agents,
        value=tuple(float(v) for v in about["value"]),
        step=model.step,
        stages=len(choice),
        stationary=stationary,
        without_equilibrium=float(about["without_equilibrium"]),
        memory=int(about["memory"]),
        seconds=float(about["seconds"]),
        policy=Policy(
            model, str(about["kind"]), Stages(fields, choice, alone, passing, {}, stationary, 0.0)
        ),
    )
