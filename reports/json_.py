"""JSON output: one document per mesh, as the published schema says; several are wrapped in one object."""

from __future__ import annotations

import json
from importlib.metadata import version
from typing import Any

from meshwright.reports.outputs import Batch, Page
from meshwright.reports.verdicts import worst_verdict

__all__ = ["render"]

_TABLE_KEYS = ("schema", "version", "mesh", "selection", "quality", "distributions", "gambit_classes", "zone_tables")


def render(batch: Batch, page: Page) -> str:
    """`meshwright.audit/1` for one mesh, `meshwright.audits/1` with the list of them for several.

    Tables alone are `meshwright.tables/1`: the same keys, fewer of them.
    """
    documents = [_tables_only(d) for d in batch.documents] if page.content == "tables" else batch.documents
    if len(documents) == 1 and not batch.unread:
        return _dump(documents[0])
    return _dump(
        {
            "schema": "meshwright.audits/1",
            "version": version("meshwright"),
            "verdict": worst_verdict(batch),
            "audits": documents,
            "errors": [{"path": u.path, "message": u.message} for u in batch.unread],
        }
    )


def _tables_only(document: dict[str, Any]) -> dict[str, Any]:
    return {**{key: document[key] for key in _TABLE_KEYS}, "schema": "meshwright.tables/1"}


def _dump(document: dict[str, Any]) -> str:
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
