"""Dynamic programming on a grid of the joint state of two agents."""
