"""OpenFOAM cases for the tests: recipes for OpenFOAM's own mesh tools, and any `Mesh` written as a polyMesh.

Loaded with `runpy.run_path` by the tests that need it.
"""

import os
import shutil
import subprocess

import numpy as np
import pytest

from meshwright.audit.connectivity import faces

CONTROL = """application checkMesh; startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1;
writeControl timeStep; writeInterval 1; writeFormat ascii; writePrecision 17; writeCompression off; timeFormat general;
timePrecision 6;
"""
SCHEMES = "ddtSchemes {} gradSchemes {} divSchemes {} laplacianSchemes {} interpolationSchemes {} snGradSchemes {}\n"
# Two blocks whose common wall leans and whose outer wall is twisted: skew, non-orthogonal, graded, warped.
LEANING = """scale 1; vertices ((0 0 0) (1 0.1 0) (1.4 1 0.1) (0 1 0) (0.1 0 1) (1.3 0 1.2) (1 1.2 1) (0 1 0.9)
(3 0 0) (3.2 1 0.2) (2.5 0 1) (3 1.3 1.1)); edges (); blocks (
hex (0 1 2 3 4 5 6 7) left (5 6 4) simpleGrading (2 0.5 1)
hex (1 8 9 2 5 10 11 6) right (6 6 4) simpleGrading (4 0.5 1));
boundary ( inlet { type patch; faces ((0 4 7 3)); } outlet { type patch; faces ((8 9 11 10)); } walls { type wall;
faces ((0 3 2 1) (1 2 9 8) (4 5 6 7) (5 10 11 6) (0 1 5 4) (1 8 10 5) (3 7 6 2) (2 6 11 9)); });
"""
CUBE = """scale 1; vertices ((0 0 0) (1 0 0) (1 1 0) (0 1 0) (0 0 1) (1 0 1) (1 1 1) (0 1 1)); edges ();
blocks (hex (0 1 2 3 4 5 6 7) core (N N N) simpleGrading (1 1 1)); boundary (
walls { type wall; faces ((0 1 5 4) (3 7 6 2) (0 3 2 1) (4 5 6 7)); }
ends { type patch; faces ((0 4 7 3) (1 2 6 5)); });
"""
# A sector of five degrees about the x axis: prisms at the axis, hexes beyond.
SECTOR = """scale 1; vertices ((0 0 0) (1 0 0) (1 1 -0.05) (0 1 -0.05) (0 1 0.05) (1 1 0.05)); edges ();
blocks (hex (0 1 2 3 0 1 5 4) (5 4 1) simpleGrading (1 1 1)); boundary (
front { type wedge; faces ((0 1 5 4)); } back { type wedge; faces ((0 3 2 1)); } tank { type wall; faces ((3 4 5 2)); }
inlet { type patch; faces ((0 4 3 0)); } outlet { type patch; faces ((1 2 5 1)); }
axis { type empty; faces ((0 1 1 0)); });
"""
SNAPPY = """castellatedMesh true; snap true; addLayers false;
geometry { ball { type searchableSphere; centre (0.5 0.5 0.5); radius 0.3; } }
castellatedMeshControls { maxLocalCells 100000; maxGlobalCells 200000; minRefinementCells 0; nCellsBetweenLevels 1;
features (); refinementSurfaces { ball { level (1 1); } } resolveFeatureAngle 30; refinementRegions {}
locationInMesh (0.051 0.061 0.071); allowFreeStandingZoneFaces true; }
snapControls { nSmoothPatch 3; tolerance 2.0; nSolveIter 10; nRelaxIter 3; }
addLayersControls { relativeSizes true; layers {} expansionRatio 1; finalLayerThickness 0.3; minThickness 0.1; nGrow 0;
featureAngle 60; nRelaxIter 3; nSmoothSurfaceNormals 1; nSmoothNormals 3; nSmoothThickness 10;
maxFaceThicknessRatio 0.5; maxThicknessToMedialRatio 0.3; minMedianAxisAngle 90; nBufferCellsNoExtrude 0;
nLayerIter 5; }
meshQualityControls { maxNonOrtho 65; maxBoundarySkewness 20; maxInternalSkewness 4; maxConcave 80; minVol 1e-13;
minTetQuality 1e-15; minArea -1; minTwist 0.02; minDeterminant 0.001; minFaceWeight 0.05; minVolRatio 0.01;
minTriangleTwist -1; nSmoothScale 4; errorReduction 0.75; }
mergeTolerance 1e-6;
"""


def head(kind, name):
    return f"FoamFile {{ version 2.0; format ascii; class {kind}; object {name}; }}\n"


def tool(name, case, *options, expected=(0,)):
    """Run one of OpenFOAM's tools; skips the test where it is not installed."""
    if shutil.which(name) is None:
        pytest.skip(f"{name} of OpenFOAM is not installed")
    env = {"WM_PROJECT_DIR": "/usr/share/openfoam", **os.environ, "FOAM_SIGFPE": "false"}
    # Some tools drop files where they run.
    run = subprocess.run(
        [name, "-case", str(case), *options],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        env=env,
        cwd=case,
    )
    assert run.returncode in expected, run.stdout[-2000:] + run.stderr[-2000:]
    return run.stdout


def settle(case, **dictionaries):
    """The system folder of a case, with these dictionaries beside the usual ones."""
    (case / "system").mkdir(parents=True, exist_ok=True)
    texts = {"controlDict": CONTROL, "fvSchemes": SCHEMES, "fvSolution": "", **dictionaries}
    for name, text in texts.items():
        (case / "system" / name).write_text(head("dictionary", name) + text)
    return case


def block_mesh(case, text, **dictionaries):
    settle(case, blockMeshDict=text, **dictionaries)
    tool("blockMesh", case)
    return case


def dual(case, text, angle):
    """Polyhedra around the points of a block mesh."""
    tool("polyDualMesh", block_mesh(case, text), "-overwrite", str(angle))
    return case


def refined(case, text, cells):
    """Some cells of a block mesh split in eight: their neighbours become polyhedra with hanging nodes."""
    block_mesh(case, text)
    folder = case / "constant/polyMesh/sets"
    folder.mkdir()
    (folder / "some").write_text(head("cellSet", "some") + f"{len(cells)}\n({' '.join(map(str, cells))})\n")
    tool("refineHexMesh", case, "some", "-overwrite")
    return case


def snapped(case, n):
    """A block with a ball cut out of it: castellated, refined and snapped."""
    block_mesh(case, CUBE.replace("N", str(n)), snappyHexMeshDict=SNAPPY)
    tool("snappyHexMesh", case, "-overwrite")
    return case


def write_case(case, mesh):
    """Any solid mesh as a case of one patch, inner faces first and in order."""
    table = faces(mesh)
    inner = np.flatnonzero(table.neighbour >= 0)
    swap = table.owner > np.where(table.neighbour >= 0, table.neighbour, table.owner)
    low = np.where(swap, table.neighbour, table.owner)
    high = np.where(swap, table.owner, table.neighbour)
    inner = inner[np.lexsort((high[inner], low[inner]))]
    order = np.concatenate([inner, np.flatnonzero(table.neighbour < 0)])
    folder = case / "constant/polyMesh"
    folder.mkdir(parents=True)
    loops = []
    for f in order.tolist():
        loop = table.nodes[table.offsets[f] : table.offsets[f + 1]].tolist()
        loops.append(loop[::-1] if swap[f] else loop)
    rows = {
        "points": ("vectorField", [f"({x!r} {y!r} {z!r})" for x, y, z in mesh.points.tolist()]),
        "faces": ("faceList", [f"{len(loop)}({' '.join(map(str, loop))})" for loop in loops]),
        "owner": ("labelList", [str(row) for row in low[order].tolist()]),
        "neighbour": ("labelList", [str(row) for row in high[inner].tolist()]),
        "boundary": (
            "polyBoundaryMesh",
            [f"hull {{ type wall; nFaces {len(order) - len(inner)}; startFace {len(inner)}; }}"],
        ),
    }
    for name, (kind, lines) in rows.items():
        (folder / name).write_text(head(kind, name) + f"{len(lines)}\n(\n" + "\n".join(lines) + "\n)\n")
    return settle(case)
