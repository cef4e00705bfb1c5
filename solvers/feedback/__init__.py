"""Players that respond to the observed state."""
