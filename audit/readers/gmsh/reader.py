"""Gmsh MSH files, versions 1 to 4.1: finds the sections, hands them to the reader of their version.

Nothing of Gmsh itself is used: its own reader runs shell commands that it finds in a file.
"""

from __future__ import annotations

from collections import Counter

from meshwright.audit.errors import ReadError
from meshwright.audit.mesh import Mesh
from meshwright.audit.readers.gmsh import version2 as gmsh2
from meshwright.audit.readers.gmsh import version4 as gmsh4
from meshwright.audit.readers.gmsh.parts import mesh_of_parts
from meshwright.audit.readers.gmsh.sections import FileKind, Section, file_kind, physical_names, sections
from meshwright.audit.readers.source import Source

__all__ = ["read_gmsh"]

_DATA = ("NodeData", "ElementData", "ElementNodeData", "InterpolationScheme")
_LOSSES = {
    "Periodic": "pairs of periodic nodes ($Periodic) are not kept",
    "PartitionedEntities": "the partition of each element is not kept",
    "GhostElements": "ghost elements of other partitions ($GhostElements) are not marked",
    **{name: f"results stored beside the mesh (${name}) are not kept" for name in _DATA},
}
_READ = ("MeshFormat", "PhysicalNames", "Entities", "Nodes", "ParametricNodes", "NOD", "ELM", "Elements")
_MOST_NAMED = 10


def read_gmsh(source: Source) -> Mesh:
    """The mesh of a Gmsh file.

    Physical groups become zones; a file without any gets a zone for each CAD entity instead. Elements of
    the highest dimension are the cells, all others the boundary. Raises ReadError.
    """
    found = [section for section in sections(source) if section.name != "Comments"]
    if not found:
        raise source.error(len(source), "a mesh after the comments")
    by_name: dict[str, Section] = {}
    for section in found:
        if section.name in (*_READ, "PartitionedEntities") and by_name.setdefault(section.name, section) is not section:
            raise source.error(section.at, f"one section ${section.name}", f"a second ${section.name}")
    if found[0].name == "NOD":
        kind = FileKind(1.0, binary=False, size=8, order="<")
        node_names, element_name = ["NOD"], "ELM"
    elif found[0].name == "MeshFormat":
        kind = file_kind(source, found[0])
        node_names, element_name = ["Nodes", "ParametricNodes"], "Elements"
    else:
        raise source.error(found[0].at, "$MeshFormat or $NOD", f"${found[0].name}")
    node_sections = [by_name[name] for name in node_names if name in by_name]
    if len(node_sections) != 1:
        raise ReadError(source.path, "", f"one section ${node_names[0]}", f"{len(node_sections)}")
    if element_name not in by_name:
        raise ReadError(source.path, "", f"a section ${element_name}", "none")
    names = physical_names(source, by_name["PhysicalNames"]) if "PhysicalNames" in by_name else {}
    elements = by_name[element_name]
    if kind.version < 4:
        nodes = gmsh2.read_nodes(source, node_sections[0], kind)
        parts = gmsh2.read_elements(source, elements, kind)
    else:
        groups: gmsh4.EntityGroups = {}
        for name in ("Entities", "PartitionedEntities"):
            if name in by_name:
                groups |= gmsh4.read_entities(source, by_name[name], kind)
        nodes = gmsh4.read_nodes(source, node_sections[0], kind)
        parts = gmsh4.read_elements(source, elements, kind, groups)
    coding = "binary" if kind.binary else "text"
    return mesh_of_parts(source, f"Gmsh MSH {kind.version} ({coding})", nodes, parts, names, _notes(found))


def _notes(found: list[Section]) -> list[str]:
    counts = Counter(section.name for section in found if section.name not in _READ)
    notes = [_LOSSES[name] for name in counts if name in _LOSSES]
    unknown = [f"${name}" for name in counts if name not in _LOSSES]
    if unknown:
        more = "" if len(unknown) <= _MOST_NAMED else f" and {len(unknown) - _MOST_NAMED} more"
        notes.append(f"sections that are not understood: {', '.join(unknown[:_MOST_NAMED])}{more}")
    return notes
