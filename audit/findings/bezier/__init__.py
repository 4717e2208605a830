"""Whether a curved cell is valid, by Bernstein bounds of its Jacobian."""
