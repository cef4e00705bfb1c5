"""Options that several commands share, declared once."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any

import typer

from ppg_env.errors import InputError

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
SeedOption = Annotated[int, typer.Option("--seed", min=0, help="Seed of everything random.")]
SolverOption = Annotated[
    str, typer.Option("--solver", help="ENGINE, or a MILP solver by its name in cvxpy.")
]
TimeLimitOption = Annotated[
    float | None,
    typer.Option("--time-limit", min=0.0, metavar="S", help="Seconds for each solution."),
]
ChargeOption = Annotated[
    str,
    typer.Option(
        "--charge",
        metavar="selfish|pigou|partial:A|right-of-way",
        help="Who pays which share of a pair's losses, in nash and best responses.",
    ),
]
WorkersOption = Annotated[
    int, typer.Option("--workers", min=1, help="Threads; results do not depend on them.")
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
        str | None, typer.Option(metavar="margin|risk", help="What safety costs.")
    ],
    "crash_cost": Annotated[float | None, typer.Option(metavar="C", help="Cost of a crash.")],
    "speed": Annotated[str | None, typer.Option(metavar="box|l1|disc", help="Set of velocities.")],
    "noise": Annotated[
        float | None, typer.Option(metavar="V", help="Noise variance per step and axis.")
    ],
}


def with_game_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give ``command`` the game options; it receives them as one mapping ``overrides``."""
    signature = inspect.signature(command, eval_str=True)
    own = [p for p in signature.parameters.values() if p.name != "overrides"]
    hints = {p.name: p.annotation for p in own}
    extra = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=hint)
        for name, hint in _GAME_OPTIONS.items()
    ]

    @wraps(command)
    def wrapper(**values: Any) -> None:
        given = {name: values.pop(name) for name in _GAME_OPTIONS}
        for name in ("lam", "gain"):
            given[name] = numbers(name, given[name])
        command(**values, overrides={k: v for k, v in given.items() if v is not None})

    keyword = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in own]
    # Typer reads what inspect.signature reports; the attribute is how to tell it.
    wrapper.__signature__ = inspect.Signature(keyword + extra)  # type: ignore[attr-defined]
    wrapper.__annotations__ = hints | dict(_GAME_OPTIONS)
    return wrapper


def numbers(name: str, text: str | None) -> float | list[float] | None:
    """The number in ``text``, or the list of numbers between its commas."""
    if text is None:
        return None
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(
            f"--{name}", f"is {text!r}", "write a number, or one per agent as in 0.2,0.8"
        ) from None
    return numbers[0] if len(numbers) == 1 else numbers
