"""Compiled code is kept under a key that changes with everything it was made from."""

from pathlib import Path

import pytest

from meshwright.audit import jit
from meshwright.repair import tet_smooth


@pytest.mark.parametrize(
    ("module", "used"),
    [
        (tet_smooth, ["repair/tet_smooth.py", "repair/tet_shape.py", "audit/jit.py", "audit/mesh.py"]),
        (jit, ["audit/jit.py"]),
    ],
)
def test_the_key_of_a_module_covers_what_it_imports_in_every_package(module, used):
    closure = {"/".join(path.parts[-2:]) for path in jit._closure(Path(module.__file__))}
    assert closure >= set(used)
