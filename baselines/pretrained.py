"""Pretrained players in the package; :func:`find_pretrained` finds those of a game.

One file per scenario, speed set and sharing, ``<scenario>-<speed>-<player>.npz``; the command
that made each is in its metadata.  ``ppg_env`` and NumPy are enough to play them.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from baselines.policy_file import Learned, read_learned
from ppg_env.errors import InputError
from ppg_env.game.game import Game

FOLDER = Path(__file__).with_name("pretrained")

FROM_SCRATCH = ("ppo-selfish", "ppo-social")
"""Players of all scenarios of the paper."""

WARM = ("ppo-warm-selfish", "ppo-warm-social")
"""Players that imitated feedback players first; of ``head_on`` with l1 speed alone."""

PLAYERS = FROM_SCRATCH + WARM


def available() -> list[Path]:
    """Return every pretrained file."""
    return sorted(FOLDER.glob("*.npz"))


def find_pretrained(player: str, game: Game) -> Learned:
    """Return the pretrained ``player`` of ``game``; raises as :func:`pretrained_file` does."""
    return _read(pretrained_file(player, game))


def pretrained_file(player: str, game: Game) -> Path:
    """Return the file of the pretrained ``player`` of ``game``.

    Raises
    ------
    InputError
        If no such player was trained for this game.
    """
    for path in available():
        if path.stem.endswith(f"-{player}") and _read(path).fits(game):
            return path
    option = " --warm-start feedback" if player in WARM else ""
    raise InputError(
        player,
        "has not been trained for this game",
        f"train it with ppg train{option}, and name the file that it writes as a player",
    )


@cache
def _read(path: Path) -> Learned:
    return read_learned(path)
