"""The game as data, and every rule about it: plans, dynamics, margins, costs, evaluation."""
