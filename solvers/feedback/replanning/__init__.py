"""Players that plan again for all agents at every step."""
