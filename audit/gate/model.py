"""What may stand in a gate file. These models are its definition: validation and the JSON Schema are made of them."""

from __future__ import annotations

import datetime as dt
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

__all__ = ["GateFile", "RuleTable", "WaiverTable", "WhereTable"]

Missing = Literal["error", "warn", "ignore"]
Number = Annotated[float, Field(allow_inf_nan=False)]
Id = Annotated[str, Field(pattern=r"^[A-Za-z0-9]+([._-][A-Za-z0-9]+)*$", max_length=100)]
Stat = Annotated[
    str,
    Field(
        pattern=r"^(max|min|mean|count|share|undefined|p(0|[1-9][0-9]?)(\.[0-9]{1,6})?|p100)$",
        description="max, min, mean, a percentile such as p99 or p99.9, count or share of the values beyond `beyond`, "
        "or undefined: how many have no value.",
        examples=["max", "min", "mean", "p99", "p99.9", "count", "share", "undefined"],
    ),
]


def _date(value: Any) -> Any:
    """A date as TOML or as ISO 8601 text."""
    if isinstance(value, str):
        return dt.date.fromisoformat(value)
    return value


def _many(value: Any) -> Any:
    """One word stands for a list of it."""
    return [value] if isinstance(value, str) else value


Words = Annotated[list[str], BeforeValidator(_many), Field(min_length=1)]


class _Table(BaseModel):
    """A table that refuses keys it does not know and values of another type."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class WallLayerTable(_Table):
    """Cells in the layers on a wall, counted from it."""

    of: str = Field("*", description="Name or pattern of the wall zones.")
    at_most: int = Field(1, ge=1, description="Number of the last layer; 1 is the one on the wall.")


class DistanceTable(_Table):
    """Cells near a zone, or away from it: by the smallest distance between corners."""

    to: str = Field(description="Name or pattern of zones of faces, cells or points.")
    at_most: Number | None = Field(None, ge=0, description="In the unit of length of the mesh.")
    at_least: Number | None = Field(None, ge=0, description="In the unit of length of the mesh.")

    @model_validator(mode="after")
    def _bounded(self) -> DistanceTable:
        if self.at_most is None and self.at_least is None:
            raise ValueError("at_most or at_least")
        return self


class WhereTable(_Table):
    """Which entities a rule is on; every key narrows it further."""

    type: Words | None = Field(None, description="Cell types: tri quad tet pyramid wedge hex polygon polyhedron, ...")
    zone: Words | None = Field(None, description="Names or patterns (* ? [...]) of zones of cells; of faces for faces.")
    role: Words | None = Field(None, description="Roles of zones: fluid, solid, wall, inlet, ...")
    wall_layer: WallLayerTable | None = None
    distance: DistanceTable | None = None


class NoWorseTable(_Table):
    """How much worse than the baseline is still no worse; the larger of both counts."""

    abs: Number = Field(0.0, ge=0)
    rel: Number = Field(0.0, ge=0, description="Part of the baseline's figure.")


class RuleTable(_Table):
    """One rule. A rule that names only the id of an inherited one changes what it gives and keeps the rest."""

    id: Id = Field(description="Unique; the last definition of an id wins.")
    name: str | None = Field(None, description="For people; the metric's title if left out.")
    metric: str | None = Field(
        None,
        description="Id of a metric (`meshwright explain` lists them), or `cells` for the share of cell types.",
        examples=["gambit.equiangle_skew", "gambit.aspect_ratio", "fluent.orthogonal_quality", "cells"],
    )
    finding: str | None = Field(
        None,
        description="Code of a check (`meshwright explain --checks`), whose entities are counted.",
        examples=["inverted-cells", "left-handed-faces", "open-edges"],
    )
    scale: Literal["fluent", "icem"] | None = Field(
        None, description="Scale on which the numbers of this rule are read: fluent 0 is best, icem 1 is best."
    )
    stat: Stat | None = None
    beyond: Number | None = Field(None, description="For count and share: values beyond this are counted.")
    side: Literal["above", "below"] | None = Field(
        None, description="On which side of `beyond` values count; the bad side of the metric if left out."
    )
    le: Number | None = Field(None, description="Fails above this.")
    lt: Number | None = Field(None, description="Fails from this on.")
    ge: Number | None = Field(None, description="Fails below this.")
    gt: Number | None = Field(None, description="Fails at this and below.")
    warn_le: Number | None = Field(None, description="Warns above this.")
    warn_lt: Number | None = Field(None, description="Warns from this on.")
    warn_ge: Number | None = Field(None, description="Warns below this.")
    warn_gt: Number | None = Field(None, description="Warns at this and below.")
    severity: Literal["error", "warn", "info", "off"] | None = Field(
        None, description="warn: a failure only warns; info: it is shown and never counts; off: no rule."
    )
    where: WhereTable | None = None
    each: Literal["zone"] | None = Field(None, description="Judge every matching zone of cells by itself.")
    faces: Literal["interior", "boundary"] | None = Field(None, description="For metrics of faces.")
    no_worse: NoWorseTable | Literal[True] | None = Field(None, description="Against the baseline.")
    on_missing: Missing | None = Field(None, description="What an undecided rule becomes; the file's if left out.")
    on_no_match: Missing | None = Field(None, description="What a rule that matches nothing becomes.")
    note: str | None = None
    source: str | None = Field(None, description="Where the limit comes from.")


class WaiverTable(_Table):
    """A failure that is accepted for a while."""

    rule: str = Field(min_length=1, description="Id of a rule, or a pattern.")
    zone: str | None = Field(None, description="Only cells of these zones are excused: the others must pass.")
    reason: str = Field(min_length=1)
    until: Annotated[dt.date, BeforeValidator(_date)] = Field(description="The last day on which it holds.")


class GateFile(_Table):
    """A gate file, `meshgate.toml`."""

    schema_version: Literal[1] = 1
    title: str = ""
    description: str = ""
    extends: Words | None = Field(
        None,
        description="Rules to begin with: preset:NAME, or a path relative to this file.",
        examples=[["preset:fluent"], ["preset:icem", "common.toml"]],
    )
    baseline: str | None = Field(
        None, description="A saved audit: file:PATH, or a name kept by `meshwright baseline save`."
    )
    on_missing: Missing = Field("error", description="What a rule becomes whose figure is not known.")
    on_no_match: Missing | None = Field(
        None,
        description="What a rule becomes that matches nothing: by default an error where a name is not in the mesh, "
        "a warning where there is no such cell.",
    )
    rule: list[RuleTable] = Field(default_factory=list)
    waiver: list[WaiverTable] = Field(default_factory=list)
