"""Best and worst equilibria: proved bounds over all equilibria of a game."""
