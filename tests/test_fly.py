"""The games of the page "Games you can fly": they load, are solved, and nothing is hit."""

from __future__ import annotations

import re
import shlex
import tomllib
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import shapely

from benchmarks.comparison.snapshots import snapshots_picture
from ppg_env import InputError, evaluate, make_game
from ppg_env.formats.plan_file import read_plan
from ppg_env.game.agent import Agent
from ppg_env.game.game import Game
from ppg_env.game.plan import Plan, Profile, make_profile
from ppg_env.game.polytope import Polytope
from tests.benchmarks.judges import picture_size
from tests.command import Ppg

DOCS = Path(__file__).parents[1] / "docs"
PAGE = (DOCS / "fly.md").read_text()
FILES = sorted((DOCS / "games").glob("*.toml"))
NAMES = ["door", "alcove", "merge", "roundabout", "shelves"]
POINTS = 1000
"""Points of each step that are looked at."""

SPEED = Polytope.box([20.0, 20.0])
TOUCH = 1e-6
"""Overlaps by less count as touching."""


def command(verb: str, name: str) -> list[str]:
    """The words of the command of the page about this game, after ``ppg``."""
    (line,) = re.findall(rf"^(ppg {verb} \S*{name}\.\S+ .*)$", PAGE, re.M)
    return shlex.split(line)[1:]


def game_of(name: str) -> Game:
    return make_game(DOCS / "games" / f"{name}.toml")


def collision_set(body: np.ndarray, other: np.ndarray) -> shapely.Geometry:
    """Displacements at which two convex bodies overlap by more than a touch."""
    differences = (body[:, None] - other[None]).reshape(-1, 2)
    return shapely.MultiPoint(differences).convex_hull.buffer(-TOUCH)


def track(game: Game, plan: Plan) -> np.ndarray:
    """(H+1, 2) positions; nan after an agent has left."""
    arrival = game.horizon if plan.arrival is None else plan.arrival
    places = np.array(plan.means[:, :2])
    places[arrival + 1 :] = places[arrival] if game.on_goal == "stay" else np.nan
    return places


def hits(game: Game, profile: Profile) -> list[str]:
    """What overlaps at one of many points of the lines between the means, by shapely."""
    tracks = [track(game, plan) for plan in profile]
    bodies = [agent.shape.vertices for agent in game.agents]
    pairs = [
        (f"{i} and {j}", tracks[i] - tracks[j], collision_set(bodies[j], bodies[i]))
        for i, j in combinations(range(len(tracks)), 2)
    ]
    for k, obstacle in enumerate(game.obstacles):
        places = np.zeros((game.horizon + 1, 2))
        if obstacle.path is not None:
            places[:] = obstacle.path[-1]
            places[: len(obstacle.path)] = obstacle.path[: game.horizon + 1]
        if obstacle.until is not None:
            places[obstacle.until :] = np.nan
        pairs += [
            (f"{i} and obstacle {k}", place - places, collision_set(obstacle.shape.vertices, body))
            for i, (place, body) in enumerate(zip(tracks, bodies, strict=True))
        ]
    share = np.linspace(0, 1, POINTS)[:, None, None]
    found = []
    for name, apart, forbidden in pairs:
        between = ((1 - share) * apart[:-1] + share * apart[1:]).reshape(-1, 2)
        between = between[np.isfinite(between).all(axis=1)]
        if shapely.contains_xy(forbidden, between).any():
            found.append(name)
    return found


@pytest.fixture(scope="module")
def plans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the plans of this module are kept."""
    return tmp_path_factory.mktemp("plans")


def test_the_page_shows_all_games_and_their_pictures() -> None:
    assert set(NAMES) <= {path.stem for path in FILES}
    for name in NAMES:
        assert command("solve", name)[1] == f"games/{name}.toml"
        picture = command("render", name)[-1]
        assert f"]({picture})" in PAGE
        picture_size(DOCS / picture)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_games_are_swept_double_integrators_with_speed_limits(path: Path) -> None:
    game = make_game(path)
    assert game.collisions == "swept"
    assert game.name == path.stem
    for agent in game.agents:
        assert (agent.state_dim, agent.control_dim, agent.dim) == (4, 2, 2)
        np.testing.assert_array_equal(agent.A[:2, 2:], np.eye(2))
        np.testing.assert_array_equal(agent.B[2:], np.eye(2))
        (region,) = agent.within
        assert np.linalg.matrix_rank(region.normals[:, 2:]) == 2
        assert agent.spectral_radius < 0.8


def test_a_polygon_is_the_union_of_its_pieces() -> None:
    for path in FILES:
        for table in tomllib.loads(path.read_text()).get("obstacle", []):
            if "polygon" in table:
                whole = shapely.Polygon(table["polygon"])
                game = make_game(path)
                pieces = [shapely.MultiPoint(o.shape.vertices).convex_hull for o in game.obstacles]
                inside = [piece for piece in pieces if whole.buffer(1e-9).contains(piece)]
                assert shapely.union_all(inside).symmetric_difference(whole).area < 1e-9


@pytest.mark.parametrize(
    "name", [NAMES[2], *(pytest.param(n, marks=pytest.mark.slow) for n in NAMES if n != "merge")]
)
def test_nothing_is_hit_between_the_steps(name: str, ppg: Ppg, plans: Path) -> None:
    words = command("solve", name)
    file = plans / f"{name}.json"
    words = [str(DOCS / word) if word.startswith("games/") else word for word in words[:-1]]
    report = ppg(*words, file, "--json").json
    assert report["status"] in ("equilibrium", "optimal")
    game, profile, _ = read_plan(file)
    assert game == game_of(name)
    judged = evaluate(game, profile)
    assert not judged.violations()
    assert None not in judged.arrival
    assert hits(game, profile) == []
    for agent, plan in zip(game.agents, profile, strict=True):
        (region,) = agent.within
        last = plan.arrival or 0
        assert (plan.means[: last + 1] @ region.normals.T <= region.offsets + 1e-6).all()
    picture = plans / f"{name}.png"
    ppg("render", file, *command("render", name)[2:-1], picture)
    picture_size(picture)


def test_the_check_of_hits_bites() -> None:
    """Two bodies that exchange places in one step overlap at neither end of it."""
    agents = [
        Agent(np.array([x, 0.0]), np.array([-x, 0.0]), Polytope.box([1.0, 1.0]), SPEED, gain=0.5)
        for x in (-2.0, 2.0)
    ]
    game = Game(tuple(agents), horizon=2, name="swap")
    profile = make_profile(game, [np.array([[4.0, 0.0], [0, 0]]), np.array([[-4.0, 0.0], [0, 0]])])
    assert [plan.arrival for plan in profile] == [1, 1]
    assert hits(game, profile) == ["0 and 1"]


def test_times_of_a_picture_are_checked(ppg: Ppg, tmp_path: Path) -> None:
    game = make_game("parallel")
    with pytest.raises(InputError, match="from 0 to 15"):
        snapshots_picture(game, (), [2, 16], str(tmp_path / "a.png"))
    assert "plans" in ppg("render", "parallel", "--times", "2", code=2).err
