"""Faults of a game file: a table of them for every key, and a strategy that makes up more."""

from __future__ import annotations

import copy
import datetime
from typing import Any

from hypothesis import strategies as st

SQUARE = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]
NAN, INF = float("nan"), float("inf")

VALID: dict[str, Any] = {
    "game": {
        "horizon": 12,
        "margin_cap": 4.0,
        "objective": "risk",
        "crash_cost": 50.0,
        "scale": "exact",
        "collisions": "swept",
        "on_goal": "stay",
        "name": "valid",
    },
    "agent": [
        {
            "start": [0.0, 0.0],
            "goal": [50.0, 0.0],
            "lam": 0.25,
            "gain": [[0.5, 0.0], [0.1, 0.5]],
            "shape": {"vertices": SQUARE},
            "control": {"disc": 8.0, "sides": 12},
            "noise": [[1.5, 0.2], [0.2, 1.0]],
            "A": [[1.0, 0.1], [0.0, 1.0]],
            "B": [[1.0, 0.0], [0.0, 0.9]],
            "sigma0": [[0.1, 0.0], [0.0, 0.1]],
            "name": "anna",
        },
        {
            "start": [20.0, 20.0],
            "goal": [20.0, -20.0],
            "gain": 0.5,
            "shape": {"normals": [[1, 0], [-1, 0], [0, 1], [0, -1]], "offsets": [3, 3, 2, 2]},
            "control": [{"l1": 9.0}, {"from": 3, "box": [4.0, 5.0]}],
            "noise": 1.5,
            "within": [
                {"low": [-40.0, -40.0], "high": [60.0, INF], "sigmas": 1.0},
                {"normals": [[1, 1]], "offsets": [90.0]},
            ],
            "reserve": 0.5,
            "effort": 0.01,
            "name": "bert",
        },
        {
            "start": [-30.0, 5.0],
            "goal": [60.0, 50.0],
            "shape": {"box": [5.0, 6.0]},
            "control": {"box": [10.0, 9.0]},
            "within": {"box": [99.0, 99.0]},
        },
    ],
    "obstacle": [
        {"vertices": [[30.0, 30.0], [40.0, 30.0], [35.0, 40.0]]},
        {"normals": [[1, 0], [-1, 0], [0, 1], [0, -1]], "offsets": [-40, 50, 3, 3]},
        {"box": [2.0, 2.0], "path": [[80.0, 0.0], [80.0, 9.0]], "noise": 0.2, "until": 6},
        {"polygon": [[70, 70], [80, 70], [80, 72], [72, 72], [72, 80], [70, 80]]},
    ],
}
MISSING = "the key is missing"

# Where in the file (keys and numbers), and what does not belong there.
FAULTS: dict[str, list[Any]] = {
    "game": [3, "x", [], [{"horizon": 3}]],
    "game.horizn": [15],
    "game.horizon": [0, -3, 2.5, 15.0, 10_001, 10**400, "15", True, NAN, INF, [15], {}],
    "game.margin_cap": [0, -1.0, 27.0, 10**400, "3", True, NAN, INF, [3.0], {}],
    "game.objective": ["safety", "", 3, True, ["risk"], {}],
    "game.crash_cost": [-1, 10**400, "much", True, NAN, INF, [1.0]],
    "game.scale": ["inexact", "", 1, ["exact"]],
    "game.collisions": ["sweep", "", 1, ["swept"]],
    "game.on_goal": ["leave", "", True, {}],
    "game.on_gaol": ["stay"],
    "game.name": [5, True, ["a"], {}],
    "agents": [[]],
    "agent": [MISSING, [], 3, "anna", {}, ["anna"], [[1]]],
    "agent.0.strat": [[0.0, 0.0]],
    "agent.0.start": [MISSING, [], 3, "x", ["0", "1"], [True, False], [[0.0, 0.0]], {}],
    "agent.1.start": [[NAN, 0.0], [0.0, INF], [10**400, 0], [1.0], [[1], [2, 3]]],
    "agent.2.start": [datetime.date(2020, 1, 1), [datetime.date(2020, 1, 1), 3], ["a", 1]],
    "agent.0.goal": [MISSING, [], 3, "x", ["0", "1"], [True, False], [[0.0, 0.0]], {}],
    "agent.1.goal": [[NAN, 0.0], [0.0, -INF], [10**400, 0], [1.0], [1, 2, 3]],
    "agent.0.lam": [1, 1.0, 1.5, -0.1, 10**400, "0.5", True, NAN, INF, [0.5], {}],
    "agent.0.gain": ["x", "0.5", True, NAN, [], [0.5, 0.5], [[0.5]], [[1, 2], [3]], {}],
    "agent.0.noise": [
        [[1.0, 0.5], [0.4, 1.0]],
        [[1.0, 2.0], [2.0, 1.0]],
        [[-1.0, 0.0], [0.0, 1.0]],
        -1.0,
        10**400,
        NAN,
        INF,
        "1.9",
        True,
        [],
        [1.9, 1.9],
        [[1.9]],
        [[NAN, 0.0], [0.0, 1.0]],
        [["1", "0"], ["0", "1"]],
        {},
    ],
    "agent.0.sigma0": [[[1.0, 0.5], [0.4, 1.0]], [[0.0, 1.0], [1.0, 0.0]], -1, NAN, "x", [], {}],
    "agent.0.A": [[[1.0]], [[1, 0], [0]], [[NAN, 0], [0, 1]], 1.0, "x", True, [], {}],
    "agent.0.B": [[[1.0, 0.0]], [[1, 0], [0]], [[INF, 0], [0, 1]], 1.0, "x", [], {}],
    "agent.1.reserve": [-1.0, 99.0, "x", True, NAN, [1.0], {}],
    "agent.1.effort": [-1.0, "x", True, NAN, INF, [1.0], {}],
    "agent.1.within": [
        3,
        "x",
        [3],
        {},
        {"lo": [0.0, 0.0]},
        {"low": [0.0, 0.0]},
        {"high": [0.0, 0.0]},
        {"low": [-40.0], "high": [60.0, 60.0]},
        {"low": [-40.0, 50.0], "high": [60.0, 40.0]},
        {"low": ["a", "b"], "high": [60.0, 40.0]},
        {"low": [[1.0], [1.0, 2.0]], "high": [60.0, 40.0]},
        {"low": [-INF, -INF], "high": [INF, INF]},
        {"low": [NAN, -40.0], "high": [60.0, 60.0]},
        {"low": [-40.0, -40.0], "high": [60.0, 60.0], "box": [1.0, 1.0]},
        {"box": [99.0, 99.0], "sigmas": -1.0},
        {"box": [99.0, 99.0], "sigmas": "x"},
        {"box": [99.0, 99.0, 99.0]},
        {"box": 99.0},
        {"normals": [[0, 0]], "offsets": [1.0]},
        {"normals": [[1, 0]], "offsets": [1.0, 2.0]},
        {"vertices": [[-40, -40], [60, -40], [60, 60], [-40, 60], [1, 1]]},
        [{"box": [99.0, 99.0]}, {"bok": [1.0, 1.0]}],
    ],
    "agent.0.name": ["", " ", 5, True, ["a"], {}],
    "agent.0.shape": [
        MISSING,
        3,
        "box",
        [],
        [1.0, 1.0],
        {},
        {"bok": [1.0, 1.0]},
        {"box": []},
        {"box": 3.0},
        {"box": "x"},
        {"box": ["1", "1"]},
        {"box": [-1.0, 1.0]},
        {"box": [NAN, 1.0]},
        {"box": [INF, 1.0]},
        {"box": [10**400, 1.0]},
        {"box": [1.0, 1.0, 1.0]},
        {"box": [[1.0, 1.0]]},
        {"box": [1.0, 1.0], "vertices": SQUARE},
        {"box": [1.0, 1.0], "sides": 4},
        {"vertices": []},
        {"vertices": "x"},
        {"vertices": [[]]},
        {"vertices": [1.0, 2.0, 3.0]},
        {"vertices": [[0, 0], [1, 1]]},
        {"vertices": [[0, 0], [1, 1], [2, 2]]},
        {"vertices": [[0, 0], [1], [0, 1]]},
        {"vertices": [[0, 0], [1, NAN], [0, 1]]},
        {"vertices": [[0, 0], [10**400, 0], [0, 1]]},
        {"vertices": [["0", "0"], ["1", "0"], ["0", "1"]]},
        {"vertices": [[1e15, 0], [1e15 + 1, 0], [1e15, 1]]},
        {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]},
        {"normals": [[1, 0]]},
        {"offsets": [1]},
        {"normals": [[1, 0], [-1, 0]], "offsets": [1]},
        {"normals": [[1, 0], [-1, 0]], "offsets": [1, 1]},
        {"normals": [[1, 0], [-1, 0], [0, 1], [0, -1]], "offsets": [-1, -1, 1, 1]},
        {"normals": [[1, 0], [-1, 0], [0, 1], [0, -1]], "offsets": [1, -1, 1, 1]},
        {"normals": [[0, 0], [-1, 0], [0, 1], [0, -1]], "offsets": [1, 1, 1, 1]},
        {"normals": "x", "offsets": "y"},
    ],
    "agent.0.control": [
        MISSING,
        3,
        {},
        {"box": [1.0]},
        {"box": [1.0, 1.0, 1.0]},
        {"box": [-1.0, 1.0]},
        {"box": 10.0},
        {"box": "x"},
        {"box": ["1", "1"]},
        {"box": [10**400, 1]},
        {"box": [[1.0], [1.0, 2.0]]},
        {"l1": 0.0},
        {"l1": -1.0},
        {"l1": "x"},
        {"l1": "3"},
        {"l1": [1.0]},
        {"l1": NAN},
        {"l1": True},
        {"l1": 10**400},
        {"l1": 1.0, "sides": 4},
        {"disc": 0.0},
        {"disc": INF},
        {"disc": 1.0, "sides": 2},
        {"disc": 1.0, "sides": 3.5},
        {"disc": 1.0, "sides": "x"},
        {"disc": 1.0, "sides": True},
        {"disc": 1.0, "sides": 10**30},
        {"disc": 1.0, "l1": 1.0},
        {"sides": 4},
        {"vertices": [[0, 0], [4, 0], [1, 1], [0, 4]]},
        {"vertices": [[1e15, 0], [1e15 + 1, 0], [1e15, 1]]},
        {"vertices": [[0.0], [1.0]]},
        {"box": [1.0, 1.0], "from": 0},
        [],
        [3],
        [{}],
        [[0, {"l1": 1.0}]],
        [{"l1": 1.0, "from": 1}],
        [{"l1": 1.0}, {"l1": 2.0}],
        [{"l1": 1.0}, {"from": 2}],
        [{"l1": 1.0}, {"l1": 2.0, "from": 0}],
        [{"l1": 1.0}, {"l1": 2.0, "from": -3}],
        [{"l1": 1.0}, {"l1": 2.0, "from": 2.5}],
        [{"l1": 1.0}, {"l1": 2.0, "from": 2.0}],
        [{"l1": 1.0}, {"l1": 2.0, "from": True}],
        [{"l1": 1.0}, {"l1": 2.0, "from": "3"}],
        [{"l1": 1.0}, {"l1": 2.0, "from": NAN}],
        [{"l1": 1.0}, {"l1": 2.0, "from": 10_001}],
        [{"l1": 1.0}, {"l1": 2.0, "from": 3}, {"l1": 1.0, "from": 3}],
        [{"l1": 1.0}, {"l1": 2.0, "from": 3}, {"l1": 1.0, "from": 2}],
        [{"l1": 1.0}, {"l1": -2.0, "from": 3}],
        [{"l1": 1.0}, {"box": [1.0, 1.0, 1.0], "from": 3}],
    ],
    "obstacle": [3, "x", {}, [3], [SQUARE]],
    "obstacle.0": [
        {},
        {"radius": 3.0},
        {"vertices": SQUARE, "name": "wall"},
        {"vertices": [[0, 0], [1, 1], [2, 2]]},
        {"vertices": [[30.0, 30.0, 0.0], [40.0, 30.0, 0.0], [35.0, 40.0, 0.0], [35.0, 40.0, 9.0]]},
        {"vertices": [[30.0], [40.0]]},
        {"vertices": [["30", "30"], ["40", "30"], ["35", "40"]]},
        {"vertices": [[30, 30], [40, 30], [33, 33], [30, 40]]},
        {"polygon": [[30, 30], [40, 30], [33, 33], [30, 40]], "colour": "red"},
        {"polygon": [[30, 30], [40, 30], [33, 33], [30, 40]], "box": [1.0, 1.0]},
        {"polygon": [[30, 30], [40, 30]]},
        {"polygon": [[30, 30], [40, 40], [40, 30], [30, 40]]},
        {"polygon": "x"},
    ],
    "obstacle.2.path": [[], 3, "x", [[1.0]], [[NAN, 1.0]], [[80.0, 0.0, 0.0]], {}],
    "obstacle.2.noise": [-1.0, "x", [[1.0]], NAN, {}],
    "obstacle.2.until": [0, -1, 2.5, "x", True, []],
    "obstacle.2.pth": [[[80.0, 0.0]]],
}
# Some mistakes can only be seen elsewhere: a body against the others', a place against a matrix.
ELSEWHERE = {
    "agent.0.shape": r"agent\[[01]\]\.shape",
    "agent.0.start": r"agent\[0\]\.(start|shape|A)",
    "agent.1.start": r"agent\[1\]\.(start|shape|control)",
    "agent.0.B": r"agent\[0\]\.(B|gain|control)",
    "agent.0.control": r"agent\[0\]\.(control|B)",
    "obstacle.2.path": r"obstacle\[2\]",
}
CASES = [(place, fault) for place, faults in FAULTS.items() for fault in faults]


def changed(tables: dict[str, Any], place: str, value: Any) -> dict[str, Any]:
    """A copy of ``tables`` with ``value`` at ``place``, or nothing there if it is MISSING."""
    result = copy.deepcopy(tables)
    *way, last = (int(key) if key.isdigit() else key for key in place.split("."))
    inner: Any = result
    for key in way:
        inner = inner[key]
    if value is MISSING:
        del inner[last]
    else:
        inner[last] = value
    return result


def places(value: Any, prefix: str = "") -> list[str]:
    """Every key and index of nested tables and lists."""
    items = value.items() if isinstance(value, dict) else enumerate(value)
    result = []
    for key, item in items if isinstance(value, (dict, list)) else ():
        result.append(f"{prefix}{key}")
        if isinstance(item, (dict, list)):
            result.extend(places(item, f"{prefix}{key}."))
    return result


PLACES = places(VALID)
KEYS = sorted({place.rsplit(".", 1)[-1] for place in PLACES if not place[-1].isdigit()})
NUMBERS = st.sampled_from([0, 1, -1, 2, 5, 0.5, -0.0, 1e-9, 1e6, 1e15, 10**400, NAN, INF, -INF])
WORDS = st.sampled_from(["", "x", "1", "risk", "margin", "exact", "anna", "a\nb", "é"])
ATOMS = NUMBERS | WORDS | st.booleans() | st.just(datetime.date(2020, 1, 1)) | st.floats(-99, 99)
VALUES = ATOMS | st.recursive(
    ATOMS,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from([*KEYS, "bogus"]), inner, max_size=3)
    ),
    max_leaves=6,
)


def at(tables: Any, place: str) -> Any:
    """What stands at a place of nested tables and lists."""
    for key in place.split("."):
        tables = tables[int(key)] if isinstance(tables, list) else tables[key]
    return tables


@st.composite
def faulty(draw: st.DrawFn) -> dict[str, Any]:
    """The valid tables after one or two changes anywhere; an unknown key is one of them."""
    tables = VALID
    for _ in range(draw(st.integers(1, 2))):
        known = places(tables)
        keys = [place for place in known if not place[-1].isdigit()]
        place = draw(st.sampled_from(keys or known) | st.sampled_from(known))
        old = at(tables, place)
        kinds = ["new", "new", "missing", "other"]
        if isinstance(old, dict):
            kinds += ["unknown"]
        if isinstance(old, list):
            kinds += ["shorter", "longer", "flat"]
        if isinstance(old, (int, float)) and not isinstance(old, bool):
            kinds += ["scaled"]
        value: Any
        match draw(st.sampled_from(kinds)):
            case "missing":
                value = MISSING
            case "unknown":
                place, value = f"{place}.bogus", draw(VALUES)
            case "shorter":
                value = old[:-1]
            case "longer":
                value = old + (old[:1] or [0.0])
            case "flat":
                value = [item for row in old for item in (row if isinstance(row, list) else [row])]
            case "scaled":
                value = old * draw(st.sampled_from([-1, 0, 0.5, 3, 1000]))
            case "other":
                value = at(VALID, draw(st.sampled_from(PLACES)))
            case _:
                value = draw(VALUES)
        tables = changed(tables, place, value)
        if not places(tables):
            break
    return tables
