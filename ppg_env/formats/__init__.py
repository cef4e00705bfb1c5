"""Game files (TOML) and plan files (JSON)."""
