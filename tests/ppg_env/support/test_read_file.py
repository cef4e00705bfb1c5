"""Reading files: everything but a regular file of bounded size is refused in one sentence."""

from __future__ import annotations

import os

import pytest

from ppg_env import InputError
from ppg_env.support.read_file import read_bytes, read_text


def test_a_regular_file_is_read(tmp_path):
    path = tmp_path / "text"
    path.write_text("Grüße", encoding="utf-8")
    assert read_text(path) == "Grüße"
    assert read_bytes(path, 7) == "Grüße".encode()


def test_a_pipe_without_a_writer_does_not_block(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="is not a regular file"):
        read_bytes(tmp_path / "pipe")


@pytest.mark.parametrize(
    ("path", "problem"),
    [
        ("/dev/zero", "is not a regular file"),
        ("/", r"cannot be read \(Is a directory\)|is not a regular file"),
        ("a\0b", "is not a path"),
        ("x" * 5000, r"cannot be read \(File name too long\)"),
        ("nowhere", "does not exist"),
    ],
)
def test_other_things_are_refused(path, problem):
    with pytest.raises(InputError, match=problem) as refusal:
        read_bytes(path)
    assert len(str(refusal.value)) < 400


def test_a_ring_of_links_is_refused(tmp_path):
    (tmp_path / "a").symlink_to(tmp_path / "b")
    (tmp_path / "b").symlink_to(tmp_path / "a")
    with pytest.raises(InputError, match="symbolic links"):
        read_bytes(tmp_path / "a")


def test_a_large_file_and_other_encodings_are_refused(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"\xff" * 100)
    with pytest.raises(InputError, match="at most"):
        read_bytes(path, 99)
    with pytest.raises(InputError, match="invalid start byte at byte 0"):
        read_text(path)
