"""Scenarios: named courses, each a function in a module of this package.

The public functions of a module are its scenarios; each returns a ``Course``.  Adding one changes
no other file.  A course contains starts, goals and obstacles; :func:`ppg_env.make_game` adds the
default body, speed, noise and weights of the paper.
"""
