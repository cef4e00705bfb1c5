"""How likely are crashes: counted, sampled where they are rare, bounded and computed."""
