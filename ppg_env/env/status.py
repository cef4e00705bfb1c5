"""Status codes of agents in the simulator, ``Simulator.status`` (copies, agents).

A step moves agents in traffic.  An arrived agent has left, or stays parked (``on_goal``); a
crashed agent is out of the game; a missing one takes no part in the episode.
"""

from __future__ import annotations

TRAFFIC, ARRIVED, CRASHED, MISSING = range(4)
