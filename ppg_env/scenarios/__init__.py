"""Scenarios: named courses, each a function in a module of this package.

A module's public functions that return a ``Course`` are its scenarios; adding one touches no
other file.  A course states starts, goals and obstacles; :func:`ppg_env.make_game` adds the default
body, speed, noise and weights of the paper.
"""
