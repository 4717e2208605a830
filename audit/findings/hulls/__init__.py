"""The outside of a mesh: its shells, their rims, and what lies on or near what."""
