"""Tables of the study ``feedback``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from benchmarks.studies.feedback.data import KINDS, PLAYERS, SELFISH
from benchmarks.studies.feedback.measures import Games, by_game, ratio, regret
from benchmarks.studies.results import NEGLIGIBLE, StudyRow, chance, crash_event
from benchmarks.studies.study import Table

GAME = ("scenario", "speed", "lam")


def tables(rows: Sequence[StudyRow]) -> Iterator[Table]:
    """Yield the tables of costs, crash probabilities, prices and regrets."""
    games, event = by_game(rows), crash_event(rows)
    heads = tuple(name.replace("-", "-\n") for name in PLAYERS)
    yield Table(
        "Expected cost",
        (*GAME, *heads),
        _lines(games, PLAYERS, _cost),
        f"Lam per step and (1 - lam) 100 for a crash, any {event}; mean over agents.",
        texts=2,
    )
    yield Table(
        "Probability that any agent crashes",
        (*GAME, *heads),
        _lines(games, PLAYERS, chance),
        f"A crash is any {event}.",
        texts=2,
    )
    yield Table(
        "Price of selfishness",
        (*GAME, *(f"{what}\n{kind}" for what in ("cost", "risk") for kind in KINDS)),
        _prices(games),
        f"Selfish over social. Cost: expected cost. Risk: probability of any {event}, in brackets "
        f"where the limits contain one; shares below {NEGLIGIBLE:g} count as {NEGLIGIBLE:g}.",
        texts=2,
    )
    measured = {key: own for key, own in games.items() if any(regret(row) for row in own.values())}
    if measured:
        yield Table(
            "Regret",
            (*GAME, *(name.replace("-", "-\n") for name in SELFISH)),
            _lines(measured, SELFISH, _regret),
            "The largest gain of an agent by the best response that dynamic programming finds, "
            "relative to the mean cost; of run 0 for learners.",
            texts=2,
        )


def _lines(
    games: Games, names: Sequence[str], shown: Callable[[StudyRow], str]
) -> list[tuple[str, ...]]:
    return [
        (scenario, speed, f"{lam:g}", *(shown(own[name]) if name in own else "-" for name in names))
        for (speed, scenario, lam), own in games.items()
    ]


def _cost(row: StudyRow) -> str:
    half = (row["expected_cost_high"] - row["expected_cost_low"]) / 2
    return f"{row['expected_cost']:.3f} ± {half:.3f}"


def _regret(row: StudyRow) -> str:
    share = regret(row)
    return "-" if share is None else f"{share.value:.2%} ± {(share.high - share.low) / 2:.2%}"


def _prices(games: Games) -> list[tuple[str, ...]]:
    return [
        (
            scenario,
            speed,
            f"{lam:g}",
            *(
                _price(own, pair, what) if set(pair) <= set(own) else "-"
                for what in ("costs", "crashes")
                for pair in KINDS.values()
            ),
        )
        for (speed, scenario, lam), own in games.items()
    ]


def _price(own: Mapping[str, StudyRow], pair: tuple[str, str], what: str) -> str:
    price = ratio(own[pair[0]], own[pair[1]], what)
    if what == "costs":
        return f"{price.value:.3f}"
    return f"{price.value:.3g}" if price.low > 1 or price.high < 1 else f"({price.value:.3g})"
