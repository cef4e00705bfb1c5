"""docs/drills.md, written from docs/drills.json."""

from __future__ import annotations

from typing import Any

from tests.drills.figures import ROOT, load

PAGE = ROOT / "docs" / "drills.md"

ABOUT = {
    "files": (
        "Files that users hand in, mutated by a fuzzer that follows coverage. A file is "
        "read, or refused in one sentence; a reader executes nothing, writes nothing, "
        "opens no connection, and has limits of time and memory."
    ),
    "hostile": (
        "Commands on files made to hurt. Each ends by itself with exit code 2 and one line."
    ),
    "faults": (
        "Faults in the answers of the linear and mixed-integer back ends, over random "
        "games. No wrong plan is accepted, no bound exceeds the true optimum, nothing "
        "is called optimal that is not."
    ),
    "kills": (
        "SIGKILL at random moments, then the same command again. The result has the "
        "bytes of an undisturbed run; seconds and dates are left out of the comparison."
    ),
    "disks": (
        "Full disks, limits on file sizes, folders that cannot be written, two "
        "processes on one store, clocks that jump. One sentence, and what was stored "
        "stays readable."
    ),
    "clusters": (
        "Workers in an environment that has only the wheel, started from the command "
        "line as the manuals of Dask and Ray say, and shards in the manner of SLURM. "
        "Results equal the local ones byte for byte."
    ),
    "soak": (
        "Environment steps in one process. Memory is flat if the largest resident size "
        "of the second half is at most 1 % above that of the first."
    ),
    "mutation": (
        "Single changes of the code (operators, constants, comparisons, conditions, "
        "dropped statements), each judged by the tests of that code. A mutant survives "
        "if all of them pass; survivors that change no result are explained in "
        "`tests/drills/equivalent.json`."
    ),
}

HEAD = """# Drills

`make drills` tries to break the software, every night: broken and hostile files, faulty back ends,
kills, full disks, clusters, long runs, and mutants of its own code. `make drills SIZE=0.05` takes
minutes. This page is written from `drills.json`, which the drills write.
"""


def page(stored: dict[str, Any]) -> str:
    """Return the page for these results."""
    parts = [HEAD]
    for name, about in ABOUT.items():
        if name not in stored:
            continue
        entry = stored[name]
        rows = [_row(figure) for figure in entry["figures"]]
        command = f"`make drills ONLY={name} SIZE={entry['size']:g}`"
        parts += [
            f"## {name.capitalize()}",
            about,
            "\n".join(("| what | tried | result | failures |", "| --- | --- | --- | --- |", *rows)),
            f"Command: {command}; {entry['cpu_seconds']:,} CPU seconds.",
        ]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _row(figure: dict[str, Any]) -> str:
    failures = "; ".join(figure["failures"]) or "none"
    cells = (figure["what"], figure["tried"], figure["result"], failures)
    return "| " + " | ".join(cell.replace("|", "/").replace("\n", " ") for cell in cells) + " |"


def write_page() -> None:
    """Write the page from the stored results."""
    PAGE.write_text(page(load()), encoding="utf-8")
