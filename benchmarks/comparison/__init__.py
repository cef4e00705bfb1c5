"""Players in one game, side by side."""
