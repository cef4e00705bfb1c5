"""Learned and hand-made players that the planners are compared with."""
