"""The table of passes, in the order in which a repair runs them."""

from __future__ import annotations

from meshwright.audit.errors import UsageError
from meshwright.repair.clean import drop_degenerate, drop_duplicates, drop_unused, weld
from meshwright.repair.delaunay import insert_delaunay
from meshwright.repair.elliptic import elliptic, elliptic_normal, winslow
from meshwright.repair.engines import pymeshlab_repair, trimesh_repair
from meshwright.repair.even import even
from meshwright.repair.intersections import untie
from meshwright.repair.laplace import laplace, odt, smart_laplace
from meshwright.repair.orient import orient
from meshwright.repair.outcome import Pass
from meshwright.repair.quads import clean_quads
from meshwright.repair.refine import bisect, insert_centroids, refine
from meshwright.repair.split import linearise, split_in_five, split_to_tets
from meshwright.repair.stars import raise_worst_cells
from meshwright.repair.stitch import stitch
from meshwright.repair.surface import drop_fins, drop_flat, drop_specks, fill_holes, split_junctions
from meshwright.repair.tet_passes import improve, raise_worst, smooth, swap
from meshwright.repair.tfi import hermite, tfi
from meshwright.repair.triangles import triangles
from meshwright.repair.untangle import relax, untangle

__all__ = ["GROUPS", "PASSES", "select_passes"]

PASSES = {
    row.name: row
    for row in (
        Pass("weld", "join points that lie on one another", weld, nothing_worse="", explicit=True),
        Pass(
            "drop-degenerate",
            "drop cells without an inside that name a point twice",
            drop_degenerate,
            nothing_worse="",
            explicit=True,
        ),
        Pass("drop-duplicates", "drop second copies of cells", drop_duplicates, nothing_worse="", explicit=True),
        Pass(
            "stitch",
            "join the free sides of parts that lie against each other",
            stitch,
            nothing_worse="",
            explicit=True,
        ),
        Pass("drop-flat", "drop triangles without height", drop_flat, nothing_worse="", explicit=True),
        Pass("split-junctions", "split triangles at T-junctions", split_junctions, nothing_worse="", explicit=True),
        Pass("drop-fins", "drop triangles that stand on an edge of three", drop_fins, nothing_worse="", explicit=True),
        Pass("drop-specks", "drop parts of less than 1 % of the area", drop_specks, nothing_worse="", explicit=True),
        Pass("orient", "reverse cells that look inside out, as their neighbours tell", orient, nothing_worse=""),
        Pass("fill-holes", "close small holes in a surface", fill_holes, nothing_worse="", explicit=True),
        Pass("untie", "cut out triangles that cross, and close the holes", untie, nothing_worse="", explicit=True),
        Pass("trimesh-repair", "trimesh's repair of a surface", trimesh_repair, nothing_worse="", explicit=True),
        Pass("pymeshlab-repair", "MeshLab's repair of a surface", pymeshlab_repair, nothing_worse="", explicit=True),
        Pass("drop-unused", "drop points of no cell", drop_unused, nothing_worse="", explicit=True),
        Pass("linearise", "second-order cells to first order", linearise, nothing_worse="", explicit=True),
        Pass(
            "split-to-tets",
            "cut hexes, wedges and pyramids into tets, quads into triangles",
            split_to_tets,
            nothing_worse="nowhere",
            explicit=True,
        ),
        Pass(
            "split-in-five",
            "cut hexes into five tets each",
            split_in_five,
            nothing_worse="nowhere",
            explicit=True,
        ),
        Pass(
            "refine",
            "cut cells at the middle of their edges: 1:4 in the plane, 1:8 in space",
            refine,
            nothing_worse="nowhere",
            explicit=True,
            once=True,
        ),
        Pass(
            "bisect",
            "cut triangles and tets at their longest edges, down to --max-edge",
            bisect,
            nothing_worse="nowhere",
            explicit=True,
            once=True,
        ),
        Pass(
            "insert-centroids",
            "cut triangles and tets 1:3 and 1:4 at their middle; this lowers the quality",
            insert_centroids,
            nothing_worse="nowhere",
            explicit=True,
            once=True,
        ),
        Pass(
            "insert-delaunay",
            "put points at circumcentres of poor or long tets and flat triangles, by Delaunay cavities",
            insert_delaunay,
            nothing_worse="nowhere",
            explicit=True,
            once=True,
        ),
        Pass(
            "untangle",
            "move inner points near inverted cells until there are none",
            untangle,
            repeats=True,
            nothing_worse="in regions",
        ),
        Pass(
            "relax",
            "move inner points of quads and hexes to the best shapes",
            relax,
            repeats=True,
            nothing_worse="in regions",
            explicit=True,
        ),
        Pass(
            "raise-worst",
            "move inner points so that the worst cell around each gets better, of any type",
            raise_worst_cells,
            repeats=True,
            explicit=True,
        ),
        Pass(
            "tfi",
            "place the points inside structured blocks by interpolation from their sides",
            tfi,
            nothing_worse="in regions",
            explicit=True,
        ),
        Pass(
            "tfi-even",
            "the same, then move the points towards right angles, as far as no mean and no worst cell loses",
            even,
            nothing_worse="in regions",
            explicit=True,
        ),
        Pass(
            "hermite",
            "the same with lines normal to the sides, for blocks of quads",
            hermite,
            nothing_worse="in regions",
            explicit=True,
        ),
        Pass(
            "winslow",
            "smooth structured blocks by Winslow's equations, which even out their spacing",
            winslow,
            nothing_worse="in regions",
            explicit=True,
        ),
        Pass(
            "elliptic",
            "smooth structured blocks by elliptic equations that keep the spacing of their sides",
            elliptic,
            nothing_worse="in regions",
            explicit=True,
        ),
        Pass(
            "elliptic-normal",
            "the same with lines normal to the sides, for blocks of quads",
            elliptic_normal,
            nothing_worse="in regions",
            explicit=True,
        ),
        Pass(
            "laplace",
            "move points to the mean of their neighbours; can invert cells, and is rolled back where it harms",
            laplace,
            repeats=True,
            nothing_worse="in regions",
            explicit=True,
        ),
        Pass(
            "smart-laplace",
            "move points towards the middle of their cells where the worst of these gains",
            smart_laplace,
            repeats=True,
            explicit=True,
        ),
        Pass(
            "odt",
            "move points of triangles and tets towards the mean of circumcentres where the worst cell gains",
            odt,
            repeats=True,
            explicit=True,
        ),
        Pass(
            "clean-quads",
            "turn edges and take points away until four quads meet at most points",
            clean_quads,
            repeats=True,
            explicit=True,
        ),
        Pass("swap", "swap edges and faces of tets", swap, repeats=True, explicit=True),
        Pass("smooth", "move inner points of tets", smooth, repeats=True, explicit=True),
        Pass("improve", "swap and smooth tets in turn, the worst last", improve, repeats=True, cautious=raise_worst),
        Pass("triangles", "swap and smooth triangles for angles and valence, the worst last", triangles, repeats=True),
    )
}


GROUPS = {
    "clean": ("weld", "drop-degenerate", "drop-duplicates", "drop-unused"),
    "surface": (
        "weld", "drop-degenerate", "drop-duplicates", "drop-flat", "split-junctions", "drop-fins", "drop-specks",
        "orient", "fill-holes", "untie", "drop-unused",
    ),
}  # fmt: skip
"""Names that stand for several passes: `surface` makes one closed surface out of the loose triangles of an STL file."""


_PLACING = ("tfi", "tfi-even", "hermite", "winslow", "elliptic", "elliptic-normal")
_EVERYWHERE = ("relax", "laplace", "smart-laplace")
"""Passes that place the points of structured blocks, each its own way; and those that move the same points too."""


def _compatible(wanted: list[str]) -> None:
    """UsageError where two passes would undo one another round after round, so that the repair came to no rest."""
    placing = [name for name in _PLACING if name in wanted]
    others = placing[1:] + [name for name in _EVERYWHERE if name in wanted]
    if placing and others:
        raise UsageError(
            f"{placing[0]} and {others[0]} would undo one another: name one, and the other in a second run"
        )


def select_passes(names: str | None) -> tuple[Pass, ...]:
    """The passes named, with commas, in the order of the table; those of a plain repair for None."""
    if names is None:
        return tuple(row for row in PASSES.values() if not row.explicit)
    named = [name.strip() for name in names.split(",") if name.strip()]
    wanted = [name for word in named for name in GROUPS.get(word, (word,))]
    for name in wanted:
        if name not in PASSES:
            raise UsageError(f"unknown pass {name[:60]!r}; known are {', '.join((*GROUPS, *PASSES))}")
    if not wanted:
        raise UsageError(f"no pass named; known are {', '.join(PASSES)}")
    _compatible(wanted)
    return tuple(row for row in PASSES.values() if row.name in wanted)
