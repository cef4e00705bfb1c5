"""Generators of the library's games, one file per kind; :mod:`.generate` writes their files."""
