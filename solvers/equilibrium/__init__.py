"""Equilibria: best responses, their dynamics, certificates, enumeration."""
