"""Rules of random draws in TOML files: what they mean, and one sentence for each mistake."""

from __future__ import annotations

import tomllib

import pytest
import tomli_w

from ppg_env.env import Choice, Near, Randomize, Uniform, read_randomize
from ppg_env.env.rule_tables import randomize_from_table, randomize_to_table
from ppg_env.errors import InputError

FILE = """
[randomize]
lam = { uniform = [0.05, 0.95] }
noise = { choice = [1.0, 2.0, 4.0] }
start = { near = 10.0 }
goal = { agent_1 = { near = [0.0, 5.0] }, 0 = { uniform = [[90.0, 40.0], [95.0, 60.0]] } }
agents = { choice = [2, 3] }
shared = ["lam"]
"""
RULE = Randomize(
    lam=Uniform(0.05, 0.95),
    noise=Choice([1.0, 2.0, 4.0]),
    start=Near(10.0),
    goal={"agent_1": Near([0.0, 5.0]), 0: Uniform([90.0, 40.0], [95.0, 60.0])},
    agents=Choice([2, 3]),
    shared=("lam",),
)


def test_a_file_is_read_as_the_rule_that_it_says(tmp_path):
    path = tmp_path / "rule.toml"
    path.write_text(FILE)
    assert read_randomize(path) == RULE


def test_tables_of_a_rule_are_read_back_exactly():
    table = randomize_to_table(RULE)
    assert randomize_from_table(table) == RULE
    assert randomize_from_table(tomllib.loads(tomli_w.dumps(table))) == RULE


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("lam = 1", "lam: is an unknown key of a file of random draws"),
        ("", "randomize: is missing; add a table"),
        ("randomize = 3", "randomize: is not a table"),
        ("[randomize]", "randomize: draws nothing"),
        ("[randomize]\nlamb = 1", "randomize.lamb: is an unknown key.*perhaps you mean 'lam'"),
        ("[randomize]\nlam = 0.5", "randomize.lam: is 0.5; write { uniform"),
        ("[randomize]\nlam = {}", "randomize.lam: is {}; write"),
        ("[randomize]\nlam = { uniformly = [0, 1] }", "randomize.lam.uniformly: .*'uniform'"),
        ("[randomize]\nlam = { uniform = 1 }", "randomize.lam: is uniform = 1; write"),
        ("[randomize]\nlam = { uniform = [1, 0] }", "randomize.lam.Uniform: is from 1.0 to 0.0"),
        ("[randomize]\nlam = { near = 1, choice = [1] }", "randomize.lam: has near and choice"),
        ("[randomize]\nlam = { near = 'import os' }", "randomize.lam.Near.*distance"),
        ("[randomize]\nlam = { choice = [nan] }", "randomize.lam.Choice.*values"),
        ("[randomize]\nstart = { 0 = { near = -1 } }", "randomize.start.0.Near: has the distance"),
        ("[randomize]\nagents = { near = 1 }", "randomize.agents: is Near"),
        ("[randomize]\nlam = { near = 0.1 }\nshared = 'lam'", "randomize.shared: is 'lam'; write"),
        ("[randomize]\nlam = { near = 0.1 }\nshared = ['size']", "randomize.shared: names 'size'"),
        ("[randomize\n", "is not valid TOML"),
    ],
)
def test_a_mistake_is_one_sentence_with_the_file_and_the_place(tmp_path, text, sentence):
    path = tmp_path / "rule.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence) as error:
        read_randomize(path)
    assert str(error.value).startswith(f"{path}: ")
    assert str(error.value).endswith(".")
