"""Check a plan of a library game with Python and NumPy alone: ``checker.py GAME.toml PLAN.json``.

Agents have means x' = A x + B u and covariances S' = (A - BK) S (A - BK)^T + W.  Bodies i and j
overlap iff r_i - r_j is inside C_j + (-C_i) = {z : a_p z <= b_p}, with unit normals.  A face has
s_p(t) = (a_p (r_i - r_j) - b_p) / (sqrt 2 sigma_p), where sigma_p^2 = a_p (S_i + S_j) a_p; without
noise the cap M if it separates the means and -inf if not.

    event       instants: an instant t in traffic, s = max_p s_p(t); swept: a step from t to t + 1
                in traffic, s = max_p min(s_p(t), s_p(t + 1))
    in traffic  remove: t < T_i and t < T_j; stay: t < T_i or t < T_j
    loss        margin: M - min(M, s); risk: crash_cost g(min(M, s)) per instant and twice that per
                step, where g(s) = (1 - erf s) / 2
    cost of i   lam T_i + (1 - lam) (sum of its losses) + effort (sum of |u|_1)

Refused: a control or mean outside its sets, a mean that is not first at the goal at the stated
arrival, an overlap, a stated number that is not the recomputed one.  Exit code: 0 accepted, 1
refused or unreadable.
"""

import itertools
import json
import math
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace as Body  # points, means [t, d], covs [t, d, d], rest, gone, unit
from typing import Any

import numpy as np

TOLERANCE = 1e-6  # of lengths, a tenth of it of controls, for a body of side 15; else in proportion
Faces = tuple[np.ndarray, np.ndarray]  # unit normals [p, d], offsets [p]


def distinct(points: np.ndarray) -> np.ndarray:
    """Return the points that differ by more than a rounding error."""
    rounded = np.round(points / np.abs(points).max(), 9) + 0.0
    return points[np.unique(rounded, axis=0, return_index=True)[1]]


def facets(points: np.ndarray) -> Faces:
    """Return the faces of the hull of ``points``, each through d of them with all on one side."""
    centred, d = distinct((points - points.mean(axis=0)) / np.ptp(points)), points.shape[1]
    rows = np.array(list(itertools.combinations(range(len(centred)), d)))
    rows = rows[np.abs(np.linalg.det(centred[rows])) > 1e-9]
    normals = np.linalg.solve(centred[rows], np.ones((len(rows), d, 1)))[..., 0]
    normals = distinct(normals[(normals @ centred.T <= 1 + 1e-9).all(axis=1)])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return normals, (normals @ points.T).max(axis=1)


def corners(table: dict[str, Any], half: float) -> np.ndarray:
    """Return the corners of a bounded set; ``half`` is 1/2 where a box has full sides."""
    if "box" in table:
        return np.array(list(itertools.product(*[(-half * x, half * x) for x in table["box"]])))
    if "vertices" in table:
        return np.array(table["vertices"], float)
    sides, radius = (table.get("sides", 16), table["disc"]) if "disc" in table else (4, table["l1"])
    angles = 2 * math.pi * np.arange(sides) / sides
    return float(radius) * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def half_spaces(table: dict[str, Any]) -> Faces:
    """Return the faces of a set of controls or states; limits of states may be infinite."""
    if "low" not in table and "box" not in table:
        return facets(corners(table, 1.0))
    high = np.array(table["high"] if "low" in table else table["box"], float)
    offsets = np.concatenate([high, -np.array(table["low"], float) if "low" in table else high])
    limited = np.isfinite(offsets)
    return np.concatenate([np.eye(len(high)), -np.eye(len(high))])[limited], offsets[limited]


def matrix(value: Any, rows: int, columns: int) -> np.ndarray:
    """Return a matrix; a number is a multiple of the identity."""
    return float(value) * np.eye(rows, columns) if np.ndim(value) == 0 else np.array(value, float)


def excess(faces: Faces, x: np.ndarray, cov: np.ndarray, sigmas: float) -> float:
    """Return how far ``x`` with so many standard deviations is beyond the faces."""
    spread = np.sqrt(np.einsum("pi,ij,pj->p", faces[0], cov, faces[0]))
    return float((faces[0] @ x + sigmas * spread - faces[1]).max())


def fly(table: dict[str, Any], horizon: int, stay: bool, u: Any, claim: Any) -> tuple[Any, ...]:
    """Return an agent's body, its states, the sum of its |u|_1, and its defects."""
    x, goal = np.array(table["start"], float), np.array(table["goal"], float)
    listed = table["control"] if isinstance(table["control"], list) else [table["control"]]
    sets = [(item.get("from", 0), half_spaces(item)) for item in listed]
    points, u, n, m = corners(table["shape"], 0.5), np.array(u, float), len(x), len(sets[0][1][0].T)
    if u.shape != (horizon, m) or not np.isfinite(u).all():
        raise ValueError(f"controls of an agent must be {horizon} x {m} finite numbers")
    A, B = matrix(table.get("A", 1.0), n, n), matrix(table.get("B", 1.0), n, m)
    K, W = matrix(table.get("gain", 0.0), m, n), matrix(table.get("noise", 1.9), n, n)
    within, d, defects = table.get("within", []), points.shape[1], []
    rooms = [(half_spaces(w), w) for w in (within if isinstance(within, list) else [within])]
    limit = TOLERANCE * float(np.ptp(points, axis=0).max()) / 15
    states, covs, arrival = [x], [matrix(table.get("sigma0", 0.0), n, n)], None
    for t in range(horizon + 1):
        x, S = states[t], covs[t]
        for (a, b), room in rooms:
            k = a.shape[1]
            if excess((a, b), x[:k], S[:k, :k], room.get("sigmas", 0.0)) > limit:
                defects.append(f"the mean is outside 'within' at {t}")
        if np.abs(x[: len(goal)] - goal).max() <= limit:
            arrival = t
            break
        if t < horizon:
            faces = [faces for first, faces in sets if first <= t][-1]
            if excess(faces, u[t], K @ S @ K.T, table.get("reserve", 0.0)) > limit / 10:
                defects.append(f"the control at {t} is outside its set")
            states.append(A @ x + B @ u[t])
            covs.append((A - B @ K) @ S @ (A - B @ K).T + W)
    if arrival is None or claim != arrival:
        defects.append(f"the stated arrival is {claim}, the mean is at the goal at {arrival}")
    means = np.array(states + [x] * (horizon - t))  # from its arrival on it is parked, or gone
    spreads = np.array(covs + [covs[t]] * (horizon - t))[:, :d, :d]
    gone = horizon if stay else t
    body = Body(points=points, means=means[:, :d], covs=spreads, rest=t, gone=gone, limit=limit)
    return body, means.tolist(), float(np.abs(u[:t]).sum()), defects


def obstacle(table: dict[str, Any], horizon: int) -> Body:
    """Return an obstacle as a body with a fixed path."""
    points, gone = corners(table, 0.5), min(table.get("until", horizon), horizon)
    path = np.array(table.get("path", [[0.0] * points.shape[1]]), float)
    steps = np.minimum(np.arange(horizon + 1), len(path) - 1)
    covs = steps[:, None, None] * matrix(table.get("noise", 0.0), path.shape[1], path.shape[1])
    return Body(points=points, means=path[steps], covs=covs, rest=steps[-1], gone=gone, limit=0.0)


def encounter(one: Body, other: Body, stay: bool, swept: bool, cap: float) -> tuple[Any, ...]:
    """Return the margins and clearances of the events in traffic, and the steps that collide."""
    a, b = facets((other.points[:, None] - one.points[None]).reshape(-1, one.points.shape[1]))
    last = min(one.gone, other.gone, max(one.rest, other.rest) if stay else one.gone) + 1
    clear = (one.means - other.means)[:last] @ a.T - b
    sigma = np.sqrt(np.einsum("pi,tij,pj->tp", a, (one.covs + other.covs)[:last], a))
    limit = max(one.limit, other.limit)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = np.where(clear >= -limit, cap, -math.inf)
        s = np.where(sigma > 0, clear / (math.sqrt(2) * sigma), s)
        start, slope = clear[:-1] + limit, np.diff(clear, axis=0)  # does the straight line enter?
        enter = np.where(slope < 0, -start / slope, 0).max(axis=1, initial=0)
        leave = np.where(slope > 0, -start / slope, 1).min(axis=1, initial=1)
    inside = (enter < leave) & ~((slope == 0) & (start >= 0)).any(axis=1)
    s, clear = (np.minimum(x[:-1], x[1:]) if swept else x[:-1] for x in (s, clear))
    return np.minimum(s.max(axis=1), cap), clear.max(axis=1) + limit, int(inside.sum())


def check(file: dict[str, Any], plan: dict[str, Any]) -> dict[str, Any]:
    """Return the recomputed values of a plan, and its defects."""
    game, agents, n = file["game"], file["agent"], len(file["agent"])
    horizon, risk = int(game.get("horizon", 15)), game.get("objective", "margin") == "risk"
    cap, price = game.get("margin_cap", 5.0 if risk else 3.0), game.get("crash_cost", 100.0)
    swept, stay = game.get("collisions", "swept") == "swept", game.get("on_goal") == "stay"
    rows = zip(agents, plan["controls"], plan["arrival"], strict=True)
    flights = [fly(agent, horizon, stay, u, claim) for agent, u, claim in rows]
    bodies = [f[0] for f in flights] + [obstacle(o, horizon) for o in file.get("obstacle", [])]
    defects = [f"agent {i}: {text}" for i in range(n) for text in flights[i][3]]
    loss, risks, least, crossed = np.zeros((n, n)), np.zeros((n, n)), cap, 0
    for i, j in itertools.product(range(n), range(len(bodies))):
        if i < j:
            s, clear, inside = encounter(bodies[i], bodies[j], stay, swept, cap)
            defects += [f"bodies {i} and {j} overlap at {t}" for t in np.flatnonzero(clear < 0)]
            g, k = sum(math.erfc(x) / 2 * (2 if swept else 1) for x in s), j if j < n else i
            loss[i, k] += price * g if risk else (cap - s).sum()  # obstacles: on the diagonal
            risks[i, k] += g
            least, crossed = min(least, s.min(initial=cap)), crossed + inside
    lam = np.array([agent.get("lam", 0.5) for agent in agents])
    own = lam * [f[0].rest for f in flights]
    own += [agent.get("effort", 0) * f[2] for agent, f in zip(agents, flights, strict=True)]
    cost, risks = (x.sum(axis=0) + x.sum(axis=1) - np.diag(x) for x in (loss, risks))
    cost = own + (1 - lam) * cost
    values: dict[str, Any] = {"arrival": [f[0].rest for f in flights], "social_cost": cost.sum()}
    values |= {"shifted_cost": cost.tolist(), "risk_sum": risks.tolist()}
    values |= {"means": [f[1] for f in flights], "potential": (own / (1 - lam)).sum() + loss.sum()}
    for key in values.keys() & plan.keys():
        said, real = np.array(plan[key], float), np.array(values[key])
        if said.shape != real.shape or not np.allclose(said, real, 1e-9, 1e-9):
            defects.append(f"the stated {key} is not the recomputed one")
    values |= {"least_margin": least, "crossings": crossed}
    return {"accepted": not defects, "defects": defects, **values}


def main(names: list[str]) -> int:
    """Check a file, and print the answer as JSON or as lines."""
    try:
        game, text = (
            tomllib.loads(Path(names[0]).read_text("utf-8")),
            Path(names[1]).read_text("utf-8"),
        )
        answer = check(game, json.loads(text))
    except (ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError) as error:
        sys.exit(f"checker.py GAME.toml PLAN.json [--json]: {error!r}")
    lines = answer["defects"][:5] or [f"accepted: social cost {answer['social_cost']:.9g}"]
    sys.stdout.write((json.dumps(answer) if "--json" in names else "\n".join(lines)) + "\n")
    return 0 if answer["accepted"] else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
