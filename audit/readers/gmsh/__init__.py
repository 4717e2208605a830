"""Gmsh MSH files, versions 1, 2 and 4."""
