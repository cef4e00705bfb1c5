"""The paper's figures and claims, from cells of a sweep to verdicts."""
