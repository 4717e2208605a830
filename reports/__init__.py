"""Command line and outputs."""
