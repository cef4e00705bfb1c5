"""The verbs of ``ppg``, in the order in which the help lists them.

A command imports what it runs inside its functions: cvxpy, numba, torch and matplotlib take
seconds to load, and ``ppg --help`` must answer in half a second.  At the top of a command's file
stand only the shared options and what prints.
"""

from __future__ import annotations

from collections.abc import Callable

import typer

from benchmarks.commands.bench import bench
from benchmarks.commands.certify import certify
from benchmarks.commands.compare import compare
from benchmarks.commands.equilibria import equilibria
from benchmarks.commands.explain import explain
from benchmarks.commands.export import export
from benchmarks.commands.feedback import feedback
from benchmarks.commands.library import library
from benchmarks.commands.regret import regret
from benchmarks.commands.render import render
from benchmarks.commands.reproduce import reproduce
from benchmarks.commands.risk import risk
from benchmarks.commands.scenarios import scenarios
from benchmarks.commands.show import show
from benchmarks.commands.solve import solve
from benchmarks.commands.study import study
from benchmarks.commands.sweep import sweep
from benchmarks.commands.train import train
from benchmarks.commands.warm import warm

VERBS: dict[str, Callable[..., None]] = {
    "scenarios": scenarios,
    "show": show,
    "solve": solve,
    "certify": certify,
    "equilibria": equilibria,
    "risk": risk,
    "train": train,
    "feedback": feedback,
    "compare": compare,
    "regret": regret,
    "reproduce": reproduce,
    "sweep": sweep,
    "study": study,
    "render": render,
    "export": export,
    "bench": bench,
    "explain": explain,
    "warm": warm,
}

GROUPS: tuple[typer.Typer, ...] = (library,)
"""Verbs with verbs of their own."""
