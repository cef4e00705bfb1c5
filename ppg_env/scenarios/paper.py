"""The four scenarios of the paper's experiments, and the scenario that its caption describes."""

from __future__ import annotations

from ppg_env.scenarios.course import Course


def opposing() -> Course:
    """Two agents head for each other's side; coordinates as printed, the second goal aside."""
    return Course([(10, 50), (90, 50)], [(95, 50), (5, 10)])


def head_on() -> Course:
    """Two agents, each bound for a point behind the other, as the paper's caption describes."""
    return Course([(10, 50), (90, 50)], [(95, 50), (5, 50)])


def parallel() -> Course:
    """Two agents side by side in the same direction."""
    return Course([(10, 70), (10, 35)], [(95, 70), (95, 35)])


def intersection() -> Course:
    """Two agents whose straight paths cross at right angles, at the same time."""
    return Course([(10, 50), (50, 10)], [(90, 50), (50, 90)])


def intersection3() -> Course:
    """Three agents whose paths cross in the middle."""
    return Course([(50, 90), (85, 30), (14, 29)], [(50, 5), (11, 73), (90, 73)])
