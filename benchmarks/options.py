"""Options that several commands share, declared once.

A command lists such options as one parameter, and a decorator replaces that parameter by the
options when Typer reads the signature:

    with_game_options      overrides: dict[str, Any]     fields of the game that were given
    with_planner_options   planner: PlannerOptions       the options named to the decorator
    with_group             any dataclass                 its fields, each an annotated option
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from ppg_env.errors import InputError
from ppg_env.support.names import LONGEST_NAME, printable
from solvers.planner_options import DEFAULTS, PlannerOptions

if TYPE_CHECKING:
    from ppg_env.game.game import Game

Command = Callable[..., None]

GameArgument = Annotated[
    str,
    typer.Argument(
        metavar="GAME", help="A scenario such as head_on or 'circle(10)', or a .toml file."
    ),
]
PlanArgument = Annotated[
    str, typer.Argument(metavar="PLAN", help="A plan file that ppg solve --out wrote.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
SeedOption = Annotated[int, typer.Option("--seed", min=0, help="Random seed.")]
WorkersOption = Annotated[
    int, typer.Option("--workers", min=1, help="Threads; results do not depend on them.")
]
JobsOption = Annotated[
    int, typer.Option("--jobs", min=1, help="Processes; results do not depend on them.")
]
CollisionsOption = Annotated[
    str,
    typer.Option(
        "--collisions",
        metavar="instants|swept",
        help="Whether bodies keep apart at the time steps (the paper) or between them too.",
    ),
]
ArenaOption = Annotated[
    str | None,
    typer.Option(
        "--arena",
        metavar="schedule|env",
        help="Plans on schedule, or the environment (default: if a player needs it).",
    ),
]
ToleranceOption = Annotated[
    float | None,
    typer.Option(
        "--tolerance",
        min=0.0,
        metavar="D",
        help="In the environment, agents arrive within D of the goal, per component (default: half "
        "of their longest step).",
    ),
]

_GAME_OPTIONS: dict[str, Any] = {
    "lam": Annotated[
        str | None,
        typer.Option(metavar="L", help="Weight of time, 0 <= L < 1; or one per agent: 0.2,0.8."),
    ],
    "gain": Annotated[
        str | None, typer.Option(metavar="K", help="Feedback gain; or one per agent.")
    ],
    "horizon": Annotated[int | None, typer.Option(help="Last time step.")],
    "margin_cap": Annotated[float | None, typer.Option(metavar="M", help="Cap on margins.")],
    "objective": Annotated[
        str | None, typer.Option(metavar="margin|risk", help="Safety cost of the objective.")
    ],
    "crash_cost": Annotated[float | None, typer.Option(metavar="C", help="Cost of a crash.")],
    "collisions": Annotated[
        str | None,
        typer.Option(
            metavar="instants|swept", help="Bodies keep apart at the steps, or between them too."
        ),
    ],
    "on_goal": Annotated[
        str | None,
        typer.Option(metavar="remove|stay", help="An arrived body leaves, or stays in the way."),
    ],
    "reserve": Annotated[
        str | None,
        typer.Option(
            metavar="Z", help="Standard deviations of feedback left free; or one per agent."
        ),
    ],
    "effort": Annotated[
        str | None, typer.Option(metavar="W", help="Cost of the sum of |u|_1; or one per agent.")
    ],
    "speed": Annotated[str | None, typer.Option(metavar="box|l1|disc", help="Set of velocities.")],
    "noise": Annotated[
        float | None, typer.Option(metavar="V", help="Noise variance per step and axis.")
    ],
}

_PER_AGENT = ("lam", "gain", "reserve", "effort")
"""Game options that take one number, or one per agent."""

_PLANNER_OPTIONS: dict[str, Any] = {
    "solver": Annotated[
        str, typer.Option("--solver", help="ENGINE, or a MILP solver by its name in cvxpy.")
    ],
    "time_limit": Annotated[
        float | None,
        typer.Option("--time-limit", min=0.0, metavar="S", help="Seconds for each solution."),
    ],
    "node_limit": Annotated[
        int | None,
        typer.Option(
            "--node-limit",
            min=1,
            help="Linear programs for social and potential, machine-independent.",
        ),
    ],
    "seed": SeedOption,
    "start": Annotated[
        str | None,
        typer.Option(
            "--start",
            metavar="straight|sequential",
            help="First profile of nash (straight up to 5 agents, else sequential).",
        ),
    ],
    "order": Annotated[
        str,
        typer.Option(
            "--order", metavar="cyclic|random|simultaneous", help="Order of moves of nash."
        ),
    ],
    "charge": Annotated[
        str,
        typer.Option(
            "--charge",
            metavar="selfish|pigou|partial:A|right-of-way",
            help="Liability rule of nash and best responses: each agent's share of a pair's "
            "losses.",
        ),
    ],
}


def named_game(call: str, overrides: dict[str, Any]) -> Game:
    """Return the game of a ``GameArgument``; a file's game without a name has that of its file."""
    from ppg_env.scenarios.make import make_game

    game = make_game(call, **overrides)
    if game.name is not None:
        return game
    name = printable(Path(call).stem).strip()[:LONGEST_NAME]
    return replace(game, name=name or None)


def with_game_options(command: Command) -> Command:
    """Give ``command`` the game options; it receives those given as a mapping ``overrides``."""
    options = [_option(name, hint, None) for name, hint in _GAME_OPTIONS.items()]

    def overrides(values: dict[str, Any]) -> dict[str, Any]:
        given = values | {name: numbers(name, values[name]) for name in _PER_AGENT}
        return {name: value for name, value in given.items() if value is not None}

    return _expanded(command, "overrides", options, overrides)


def with_planner_options(*names: str, **defaults: Any) -> Callable[[Command], Command]:
    """Give a command the planner options ``names``; it receives one ``planner: PlannerOptions``.

    ``defaults`` are those that differ from the defaults of :class:`PlannerOptions`.
    """
    options = [_option(name, _PLANNER_OPTIONS[name], (DEFAULTS | defaults)[name]) for name in names]

    def planner(values: dict[str, Any]) -> PlannerOptions:
        from solvers.dispatch import check_solver

        if "solver" in values:
            values["solver"] = check_solver(values["solver"])
        return PlannerOptions(**values)

    return lambda command: _expanded(command, "planner", options, planner)


def with_group(parameter: str, group: type) -> Callable[[Command], Command]:
    """Give a command the fields of the dataclass ``group`` as options.

    The command receives one ``group`` object as ``parameter``.
    """
    hints = get_type_hints(group, include_extras=True)
    options = [_option(f.name, hints[f.name], f.default) for f in fields(group)]
    return lambda command: _expanded(command, parameter, options, lambda values: group(**values))


def _option(name: str, hint: Any, default: Any) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def _expanded(
    command: Command,
    parameter: str,
    options: Sequence[inspect.Parameter],
    gather: Callable[[dict[str, Any]], Any],
) -> Command:
    """Replace one parameter by ``options``; the command receives ``gather`` of their values."""
    expanded: list[inspect.Parameter] = []
    for own in inspect.signature(command, eval_str=True).parameters.values():
        own = own.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        expanded += options if own.name == parameter else [own]

    @wraps(command)
    def wrapper(**values: Any) -> None:
        given = {option.name: values.pop(option.name) for option in options}
        command(**values, **{parameter: gather(given)})

    # Typer and the docs read what inspect.signature reports: this attribute.
    wrapper.__signature__ = inspect.Signature(expanded)  # type: ignore[attr-defined]
    wrapper.__annotations__ = {own.name: own.annotation for own in expanded}
    return wrapper


def numbers(name: str, text: str | None) -> float | list[float] | None:
    """Return the number in ``text``, or the list of its comma-separated numbers."""
    if text is None:
        return None
    listed = number_list(name, text)
    return listed[0] if len(listed) == 1 else listed


def number_list(name: str, text: str) -> list[float]:
    """Return the comma-separated numbers in ``text``, the value of the option ``name``."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(
            f"--{name}", f"is {text!r}", "write a number, or one per agent as in 0.2,0.8"
        ) from None


def shard_numbers(text: str) -> tuple[int, int]:
    """Return the two numbers of ``1/4``, the value of the option ``shard``."""
    try:
        index, count = map(int, text.split("/"))
    except ValueError:
        raise InputError("--shard", f"is {text!r}", "write i/n, such as 1/4") from None
    return index, count
