"""The table of passes, in the order in which a repair runs them."""

from __future__ import annotations

from meshwright.audit.errors import UsageError
from meshwright.repair.clean import drop_degenerate, drop_duplicates, drop_unused, weld
from meshwright.repair.orient import orient
from meshwright.repair.outcome import Pass
from meshwright.repair.tet_passes import improve, raise_worst, smooth, swap
from meshwright.repair.triangles import triangles
from meshwright.repair.untangle import untangle

__all__ = ["PASSES", "select_passes"]

PASSES = {
    row.name: row
    for row in (
        Pass("weld", "join points that lie on one another", weld, keeps_volume=False, explicit=True),
        Pass(
            "drop-degenerate",
            "drop cells that name a point twice and have no volume",
            drop_degenerate,
            keeps_volume=False,
            explicit=True,
        ),
        Pass("drop-duplicates", "drop second copies of cells", drop_duplicates, keeps_volume=False, explicit=True),
        Pass("drop-unused", "drop points of no cell", drop_unused, explicit=True),
        Pass("orient", "reverse cells that look inside out, as their neighbours tell", orient, keeps_orientation=False),
        Pass("untangle", "move inner points until no cell is inverted, then to better shapes", untangle, repeats=True),
        Pass("swap", "swap edges and faces of tets", swap, repeats=True, explicit=True),
        Pass("smooth", "move inner points of tets", smooth, repeats=True, explicit=True),
        Pass("improve", "swap and smooth tets in turn, the worst last", improve, repeats=True, cautious=raise_worst),
        Pass("triangles", "swap and smooth triangles for angles and valence, the worst last", triangles, repeats=True),
    )
}


def select_passes(names: str | None) -> tuple[Pass, ...]:
    """The passes named, with commas, in the order of the table; those of a plain repair for None."""
    if names is None:
        return tuple(row for row in PASSES.values() if not row.explicit)
    wanted = [name.strip() for name in names.split(",") if name.strip()]
    for name in wanted:
        if name not in PASSES:
            raise UsageError(f"unknown pass {name[:60]!r}; known are {', '.join(PASSES)}")
    if not wanted:
        raise UsageError(f"no pass named; known are {', '.join(PASSES)}")
    return tuple(row for row in PASSES.values() if row.name in wanted)
