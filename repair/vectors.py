"""Vectors of space in kernels: three numbers that the compiler keeps in registers."""

from __future__ import annotations

from meshwright.audit.jit import inner
from meshwright.audit.mesh import Floats

__all__ = ["Vector", "between", "cross", "dot"]

Vector = tuple[float, float, float]


@inner
def between(points: Floats, a: int, b: int) -> Vector:
    """The edge from point a to point b."""
    return points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]


@inner
def dot(u: Vector, v: Vector) -> float:
    """u . v."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@inner
def cross(u: Vector, v: Vector) -> Vector:
    """u x v."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
