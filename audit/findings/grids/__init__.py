"""Structured blocks: singular edges of a hexahedral mesh and the cuts that run on from them."""
