"""The instance library: games with names, best known plans, proved bounds, and a checker."""
