"""Formats that meshio reads, in a guarded child process."""
