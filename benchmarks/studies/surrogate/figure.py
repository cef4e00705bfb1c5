"""The figure of the study ``surrogate``: an example, and scores by crash probability."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from benchmarks.figures import new_figure
from benchmarks.studies.orders import GamePlans, clearest
from benchmarks.studies.results import NEGLIGIBLE, StudyRow, chance, limits
from benchmarks.studies.surrogate.data import CAPS, SCORES, plan_name
from ppg_env.plotting import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = (0, len(CAPS) - 1, len(CAPS))
"""Scores with a column: the deficits at the smallest and the largest cap, and the bound."""

STYLES = {
    "nash": (COLOURS[1], "o"),
    "potential": (COLOURS[0], "s"),
    "social": (COLOURS[2], "^"),
    "straight": (COLOURS[6], "x"),
}


def draw_scores(compared: Sequence[GamePlans], event: str) -> Figure:
    """Draw the clearest example, and a row of panels for each game with significant pairs.

    ``event`` says what a crash is.
    """
    shown = [game for game in compared if game.pairs]
    lines = 1 + len(shown)
    figure = new_figure(3.4 * len(SHOWN), 2.2 + 2.2 * lines)
    places = figure.add_gridspec(lines, len(SHOWN), height_ratios=[1.5] + [1.0] * len(shown))
    _example(figure.add_subplot(places[0, :]), compared)
    handles: dict[str, Any] = {}
    for k, game in enumerate(shown, start=1):
        first = None
        for j, score in enumerate(SHOWN):
            axes = figure.add_subplot(places[k, j], sharey=first)
            first = first or axes
            _scatter(axes, game, score)
            handles |= dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
        assert first is not None
        first.set_title(game.name, fontsize=9, loc="left", fontweight="bold")
        first.set_ylabel(f"Pr(any\n{event})", fontsize=8)
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=5, fontsize=8)
    return figure


def _scatter(axes: Axes, game: GamePlans, score: int) -> None:
    """Draw plans with their 95 % limits, those of negligible risk hollow at the bottom."""
    for plan in game.plans:
        colour, marker = STYLES[plan["player"]]
        place, shown = plan["scores"][score], _shown(plan)
        axes.plot([place, place], limits(plan), "-", color=colour, linewidth=0.7)
        risky = shown > NEGLIGIBLE
        fill = {"label": plan["player"]} if risky else {"markerfacecolor": "none"}
        axes.plot(place, shown, marker, color=colour, markersize=4, linestyle="", **fill)
    best = clearest([game], score)
    if best is not None:
        ends = (best[1].safer, best[1].riskier)
        axes.plot(
            [plan["scores"][score] for plan in ends], [_shown(plan) for plan in ends],
            ":", color="black", linewidth=1.2, label="clearest misordered pair",
        )  # fmt: skip
    axes.set_yscale("log")
    axes.set_ylim(NEGLIGIBLE / 3, 2.0)
    if score == SHOWN[-1]:
        axes.set_xscale("log")
    axes.set_xlabel(SCORES[score], fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.3)


def _shown(plan: StudyRow) -> float:
    return float(max(plan["crash_probability"], NEGLIGIBLE))


def _example(axes: Axes, compared: Sequence[GamePlans]) -> None:
    """Draw the smallest margin over time of the pair that a deficit misorders most clearly."""
    wrong = [(k, *best) for k in range(len(CAPS)) if (best := clearest(compared, k)) is not None]
    axes.set_xlabel("time (steps)", fontsize=8)
    axes.set_ylabel("smallest margin (√2 standard deviations)", fontsize=8)
    axes.grid(alpha=0.3)
    if not wrong:
        axes.set_title("No pair is misordered significantly", fontsize=10)
        return
    score, game, pair = max(wrong, key=lambda example: example[2].least)
    marks = (
        (pair.riskier, COLOURS[1], "o-", "preferred"),
        (pair.safer, COLOURS[0], "s--", "crashes less"),
    )
    for plan, colour, style, what in marks:
        value = plan["scores"][score]
        label = f"{what}: {plan_name(plan)}, deficit {value:.3g}, crash probability {chance(plan)}"
        axes.plot(plan["margins"], style, color=colour, markersize=4, linewidth=1.2, label=label)
    axes.axhline(CAPS[score], color="0.5", linewidth=0.9, linestyle=":", label="the cap")
    axes.legend(fontsize=8)
    axes.set_title(f"The clearest misordered pair, by {SCORES[score]}: {game.name}", fontsize=10)
