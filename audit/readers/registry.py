"""The formats: how each is recognised by its content, who reads it, what is kept."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from meshwright.audit.readers.source import Source

__all__ = ["FORMATS", "REFUSED_FORMATS", "Format", "Probe", "RefusedFormat"]

_HEAD = 1 << 16


@dataclass(frozen=True)
class Probe:
    """What formats are told apart by.  head: the first 64 KiB without leading white space.  name: in lower case."""

    source: Source
    head: bytes
    name: str

    @classmethod
    def of(cls, source: Source, name: str | None = None) -> Probe:
        """The probe of a file; `name` where the source's own path does not tell it."""
        label = Path(name or source.path).name.lower()
        return cls(source, source.data[:_HEAD].tobytes().lstrip(), label.removesuffix(".gz"))

    def has(self, pattern: bytes) -> bool:
        """Whether a line of the head matches."""
        return re.search(pattern, self.head, re.MULTILINE) is not None

    def hdf5_with(self, name: bytes) -> bool:
        """Whether this is HDF5 or netCDF and an object of that name is in it."""
        return self.head.startswith((b"\x89HDF", b"CDF\x01", b"CDF\x02", b"CDF\x05")) and self.source.find(name) >= 0


Sniff = Callable[[Probe], bool]


@dataclass(frozen=True)
class Format:
    """A format that can be read.

    reader: "module:function", imported when it is needed.  route: "own" (function of the source) or "meshio"
    (function of the source and `meshio`).  sniff: by content, never by the suffix alone where content tells.
    zones: what becomes a zone.  order: highest order kept.  binary: whether its binary form is read; .gz always is.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    reader: str
    route: str
    sniff: Sniff
    zones: str = ""
    order: int = 1
    binary: bool = False
    notes: str = ""
    meshio: str = ""


@dataclass(frozen=True)
class RefusedFormat:
    """A format that is recognised in order to say what to do instead."""

    title: str
    advice: str
    sniff: Sniff


def _starts(*words: bytes) -> Sniff:
    return lambda probe: probe.head.startswith(words)


def _lines(pattern: bytes) -> Sniff:
    return lambda probe: probe.has(pattern)


def _fluent(probe: Probe) -> bool:
    if not probe.head.startswith(b"("):
        return False
    # Imported when the first byte fits, for the reader needs the compiler and this module must load fast.
    from meshwright.audit.readers.fluent.reader import sniff_fluent  # noqa: PLC0415

    return sniff_fluent(probe.head, probe.name)


def _xml(word: bytes) -> Sniff:
    return lambda probe: probe.head.startswith(b"<") and re.search(rb"<(?:\w+:)?" + word, probe.head) is not None


def _binary_stl(probe: Probe) -> bool:
    size = len(probe.source)
    if size < 84 or (probe.head.startswith(b"solid") and b"facet" in probe.head):
        return False
    count = int.from_bytes(probe.source.data[80:84].tobytes(), "little")
    return size == 84 + 50 * count or probe.name.endswith(".stl")


def _medit_binary(probe: Probe) -> bool:
    head = probe.source.data[:8].tobytes()
    return any(head[:4] == (1).to_bytes(4, e) and 1 <= int.from_bytes(head[4:], e) <= 4 for e in ("little", "big"))


def _suffix(*suffixes: str, content: bytes = b"") -> Sniff:
    return lambda probe: probe.name.endswith(suffixes) and probe.has(content)


_VIA_MESHIO = "meshwright.audit.readers.foreign.reader:read_via_meshio"


def _meshio(name: str, title: str, suffixes: tuple[str, ...], sniff: Sniff, meshio: str = "", **kept: object) -> Format:
    return Format(name, title, suffixes, _VIA_MESHIO, "meshio", sniff, meshio=meshio or name, **kept)  # type: ignore[arg-type]


FORMATS: tuple[Format, ...] = (
    Format(
        "openfoam",
        "OpenFOAM case or polyMesh",
        (".foam", "/"),
        "meshwright.audit.readers.openfoam.reader:read_openfoam",
        "own",
        _lines(rb"^FoamFile\b"),
        zones="patches, cellZones, faceZones, pointZones",
        binary=True,
        notes="a folder, its .foam marker or any file of constant/polyMesh",
    ),
    Format(
        "fluent",
        "ANSYS Fluent mesh or case",
        (".msh", ".cas"),
        "meshwright.audit.readers.fluent.reader:read_fluent",
        "own",
        _fluent,
        zones="zones with their types",
        binary=True,
        notes="legacy .msh and .cas; of a case only the mesh",
    ),
    Format(
        "gmsh",
        "Gmsh MSH 1, 2 and 4",
        (".msh", ".msh2", ".msh4"),
        "meshwright.audit.readers.gmsh.reader:read_gmsh",
        "own",
        _lines(rb"\A\$(?:MeshFormat|NOD|Comments|PhysicalNames)\s"),
        zones="physical groups, or CAD entities where there are none",
        order=2,
        binary=True,
        notes="cells of third and higher order are measured by their corners",
    ),
    _meshio(
        "vtu",
        "VTK XML unstructured grid",
        (".vtu",),
        _xml(rb'VTKFile[^>]*type="UnstructuredGrid"'),
        order=2,
        binary=True,
    ),
    _meshio("vtk", "VTK legacy", (".vtk",), _starts(b"# vtk DataFile"), order=2, binary=True),
    _meshio(
        "xdmf", "XDMF", (".xdmf", ".xmf"), _xml(rb"Xdmf\b"), order=2, binary=True, notes="data files in the same folder"
    ),
    _meshio("dolfin", "DOLFIN XML", (".xml",), _xml(rb"dolfin\b"), "dolfin-xml"),
    _meshio("medit", "Medit", (".mesh",), _lines(rb"\A(?:#.*\s+)*MeshVersionFormatted\b"), zones="references"),
    _meshio("meditb", "Medit, binary", (".meshb",), _medit_binary, "medit", zones="references", binary=True),
    _meshio("su2", "SU2", (".su2",), _lines(rb"^\s*NDIME\s*="), zones="markers"),
    _meshio("netgen", "Netgen", (".vol",), _lines(rb"\A(?:#.*\s+)*mesh3d\b"), zones="regions", order=2),
    _meshio(
        "nastran",
        "Nastran bulk data",
        (".bdf", ".nas", ".dat", ".fem"),
        _lines(rb"^(?:GRID[*, ]|BEGIN BULK|(?:CTETRA|CHEXA|CPENTA|CQUAD4|CTRIA3)[*, ])"),
        zones="properties",
        order=2,
    ),
    _meshio("mdpa", "Kratos", (".mdpa",), _lines(rb"^\s*Begin\s+(?:Nodes|ModelPartData|Properties)\b")),
    _meshio("permas", "PERMAS", (".dato", ".post"), _lines(rb"^\s*\$ENTER COMPONENT"), order=2),
    _meshio(
        "abaqus",
        "Abaqus input",
        (".inp",),
        lambda probe: (
            probe.has(rb"(?i)^\*(?:NODE|HEADING|PART|ELEMENT)\b") and not probe.has(rb"^\*(?:KEYWORD|ELEMENT_)")
        ),
        zones="element and node sets",
        order=2,
    ),
    _meshio(
        "flac3d",
        "FLAC3D grid",
        (".f3grid",),
        lambda probe: probe.has(rb"\A\* ?FLAC3D") or probe.has(rb"^G +\d+ +\S+ +\S+ +\S+\s*$"),
        zones="groups",
    ),
    _meshio(
        "med",
        "MED (Salome)",
        (".med",),
        lambda probe: probe.hdf5_with(b"ENS_MAA"),
        zones="groups",
        order=2,
        binary=True,
    ),
    _meshio("h5m", "MOAB", (".h5m",), lambda probe: probe.hdf5_with(b"tstt"), binary=True),
    _meshio("hmf", "HMF", (".hmf",), lambda probe: probe.hdf5_with(b"hmf"), binary=True),
    _meshio(
        "exodus",
        "Exodus II",
        (".e", ".exo", ".ex2", ".gen"),
        lambda probe: probe.hdf5_with(b"num_nod_per_el"),
        zones="node sets",
        order=2,
        binary=True,
        notes="needs the Python package netCDF4",
    ),
    _meshio("ugrid", "AFLR UGRID", (".ugrid",), _suffix(".ugrid"), zones="surface ids", binary=True),
    _meshio(
        "tetgen",
        "TetGen",
        (".node", ".ele"),
        _suffix(".node", ".ele", content=rb"\A(?:#.*\s+)*\d+[ \t]+\d+"),
        zones="regions",
    ),
    _meshio("ply", "PLY surface", (".ply",), _lines(rb"\Aply\s"), binary=True),
    _meshio("off", "OFF surface", (".off",), _lines(rb"\AOFF\s")),
    _meshio("obj", "Wavefront OBJ surface", (".obj",), _suffix(".obj", content=rb"^v\s+\S+\s+\S+\s+\S+")),
    _meshio(
        "stl",
        "STL surface",
        (".stl",),
        lambda p: p.has(rb"\Asolid\b[^\0]*?^\s*facet\b") or _binary_stl(p),
        binary=True,
    ),
    _meshio("tecplot", "Tecplot text", (".dat", ".tec", ".plt"), _lines(rb"(?i)^\s*(?:TITLE|VARIABLES|ZONE)\b.*[=]")),
    _meshio(
        "avsucd",
        "AVS UCD text",
        (".avs", ".inp", ".ucd"),
        _lines(rb"\A(?:#.*\s+)*\d+[ \t]+\d+[ \t]+\d+[ \t]+\d+[ \t]+\d+[ \t]*\r?\n"),
        zones="materials",
    ),
)
"""Every format that can be read, in the order in which they are tried."""

_SAVE = "save the mesh as Gmsh MSH, VTU, Fluent .msh or Abaqus .inp"

REFUSED_FORMATS: tuple[RefusedFormat, ...] = (
    RefusedFormat(
        "Fluent HDF5", "write a legacy file (File > Write > Case, without .h5)", lambda p: p.hdf5_with(b"zoneTopology")
    ),
    RefusedFormat("CGNS", _SAVE, lambda p: p.hdf5_with(b"CGNSLibraryVersion") or b"ADF Database" in p.head[:64]),
    RefusedFormat("GAMBIT neutral", "export Fluent .msh from GAMBIT instead", _lines(rb"\A\s*CONTROL INFO")),
    RefusedFormat("FEMAP neutral", "export Nastran .bdf from FEMAP instead", _lines(rb"\A(?:\d+\s+)?-1\s+100\s")),
    RefusedFormat("I-DEAS universal", _SAVE, _lines(rb"\A-1\s+\d{2,4}\s")),
    RefusedFormat(
        "ANSYS Mechanical APDL",
        "write a Fluent .msh, or a Nastran .bdf",
        _lines(rb"^(?:NBLOCK|EBLOCK|/PREP7|/COM,\s*ANSYS)"),
    ),
    RefusedFormat("LS-DYNA keyword", _SAVE, _lines(rb"^\*(?:KEYWORD|ELEMENT_(?:SHELL|SOLID|BEAM|SPH))")),
    RefusedFormat("Patran neutral", "export Nastran .bdf from Patran instead", _lines(rb"\A25\s+0\s+0\s+1\s")),
    RefusedFormat("Plot3D", _SAVE, _suffix(".xyz", ".p3d", ".x", ".q", ".fmt")),
    RefusedFormat("CalculiX result", "use the .inp file of the model", _lines(rb"\A1C")),
    RefusedFormat("COMSOL", _SAVE, _lines(rb"\A# Created by COMSOL")),
    RefusedFormat("Cast3M", _SAVE, _lines(rb"\AENREGISTREMENT DE TYPE")),
    RefusedFormat("Cart3D", "convert it to STL or PLY", _suffix(".tri")),
    RefusedFormat("MFEM", "save it as VTK from MFEM", _lines(rb"\AMFEM ")),
    RefusedFormat("EnSight", _SAVE, _lines(rb"^type:\s*ensight|\AEnSight")),
    RefusedFormat("binary Tecplot", "write the text form", _starts(b"#!TDV")),
    RefusedFormat("a zip archive (3MF or packed files)", "unpack it first", _starts(b"PK\x03\x04")),
    RefusedFormat("VTK XML of another data set type", "save it as an unstructured grid (.vtu)", _xml(rb"VTKFile\b")),
    RefusedFormat(
        "binary AVS UCD",
        "write the text form",
        lambda p: p.head[:1] == b"\x07" and p.name.endswith((".inp", ".ucd", ".avs")),
    ),
    RefusedFormat("HDF5 of an unknown kind", _SAVE, _starts(b"\x89HDF", b"CDF")),
)
"""Formats whose files are refused with advice, since no reader here or in meshio gets them right."""
