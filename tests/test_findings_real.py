"""Checks held against checkMesh, on a box that blockMesh makes: sound, and then torn."""

import os
import shutil
import subprocess

import pytest

from meshwright.audit.findings import run_checks
from meshwright.audit.mesh import Mesh
from meshwright.audit.readers import read


def found(mesh):
    return {finding.code: finding for finding in run_checks(mesh)}


BLOCK = """FoamFile { version 2.0; format ascii; class dictionary; object blockMeshDict; }
vertices ((0 0 0) (1 0 0) (1 1 0) (0 1 0) (0 0 1) (1 0 1) (1 1 1) (0 1 1));
blocks (hex (0 1 2 3 4 5 6 7) (3 3 3) simpleGrading (1 1 1));
patches (); mergePatchPairs ();
"""
CONTROL = """FoamFile { version 2.0; format ascii; class dictionary; object controlDict; }
application checkMesh; startFrom startTime; startTime 0; stopAt endTime; endTime 0; deltaT 1; writeInterval 1;
"""
SCHEMES = """FoamFile { version 2.0; format ascii; class dictionary; object fvSchemes; }
ddtSchemes {} gradSchemes {} divSchemes {} laplacianSchemes {} interpolationSchemes {} snGradSchemes {}
"""


def openfoam(tool, case):
    """What an OpenFOAM tool prints about a case."""
    home = os.environ.get("WM_PROJECT_DIR", "/usr/share/openfoam")
    run = subprocess.run(
        [tool, "-case", str(case)],
        check=False,
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "WM_PROJECT_DIR": home},
    )
    return run.stdout


@pytest.fixture
def case(tmp_path):
    """A 3 x 3 x 3 box made by blockMesh."""
    if shutil.which("blockMesh") is None or shutil.which("checkMesh") is None:
        pytest.skip("OpenFOAM is not installed")
    system = tmp_path / "system"
    system.mkdir()
    (system / "controlDict").write_text(CONTROL)
    (system / "blockMeshDict").write_text(BLOCK)
    for name in ("fvSchemes", "fvSolution"):
        (system / name).write_text(SCHEMES)
    assert "End" in openfoam("blockMesh", tmp_path)
    return tmp_path


def move_inner_point(case, to):
    """Put the point (1/3, 1/3, 1/3) of the box somewhere else."""
    points = case / "constant" / "polyMesh" / "points"
    lines = points.read_text().splitlines()
    row = next(i for i, line in enumerate(lines) if line.count("0.33333") == 3)
    lines[row] = f"({to[0]} {to[1]} {to[2]})"
    points.write_text("\n".join(lines) + "\n")


def test_checkmesh_and_the_checks_agree_on_a_sound_box_and_on_a_torn_one(case):
    assert "Mesh OK." in openfoam("checkMesh", case)
    assert set(found(read(case))) <= {"features", "blocks", "wall-orthogonality"}
    move_inner_point(case, (1.4, 1.4, 1.4))
    mesh: Mesh = read(case)
    said = openfoam("checkMesh", case)
    findings = found(mesh)
    assert "Mesh OK." not in said
    # "Zero or negative cell volume detected.  Minimum negative volume: ..., Number of negative volume cells: n"
    number = int(said.split("Number of negative volume cells:")[1].split()[0])
    assert number > 0
    assert findings["inverted-cells"].count == number
    # "n faces are incorrectly oriented": OpenFOAM judges by face pyramids, which reversed faces fail as well
    assert "incorrectly oriented" in said
    assert findings["left-handed-faces"].count > 0
