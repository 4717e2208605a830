"""OpenFOAM polyMesh cases."""
