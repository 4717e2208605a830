"""Baselines: audits kept to hold later ones against, in the folder `.meshwright/baselines` of a project."""

from __future__ import annotations

import re
from pathlib import Path

from meshwright.audit.errors import MeshwrightError, UsageError, printable
from meshwright.audit.profiles.baseline import Baseline
from meshwright.reports.saved import read_saved

__all__ = ["FOLDER", "baseline_of", "checked_name", "find_baseline", "folder_of"]

FOLDER = Path(".meshwright") / "baselines"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")
_FILE = "file:"


def folder_of(start: Path | None = None) -> Path:
    """The folder of baselines of the project around `start`: the nearest with `.meshwright` or `.git`, else itself."""
    here = (start or Path.cwd()).resolve()
    for folder in (here, *here.parents):
        if (folder / ".meshwright").is_dir() or (folder / ".git").exists():
            return folder / FOLDER
    return here / FOLDER


def checked_name(name: str) -> str:
    """The name of a baseline; UsageError for one that could be a path."""
    if not _NAME.fullmatch(name) or name.endswith(".json"):
        raise UsageError(f"baseline {printable(name)!r}: expected a name of letters, digits and . _ - without .json")
    return name


def find_baseline(reference: str) -> Path:
    """The file that a reference means: `file:PATH`, the path of a file, or a name kept by `baseline save`."""
    if reference.startswith(_FILE):
        return Path(reference.removeprefix(_FILE))
    if Path(reference).is_file() or not _NAME.fullmatch(reference) or reference.endswith((".json", ".html", ".gz")):
        return Path(reference)
    return folder_of() / f"{reference}.json"


def baseline_of(reference: str) -> Baseline:
    """The baseline that a reference means. One that cannot be read says so: what needs it is then undecided."""
    path = find_baseline(reference)
    try:
        document, digest = read_saved(path)
    except MeshwrightError as error:
        return Baseline(None, str(path), f"the baseline could not be read: {error}")
    return Baseline(document, str(path), "", digest)
