"""Laying out a text page: columns that cut long names but never a number, and the page as one string."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

from rich.cells import cell_len, set_cell_size
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.text import Text

__all__ = ["Column", "Grid", "page_text"]

_GAP = 2
_LEAST_NAME = 8


@dataclass(frozen=True)
class Column:
    """A column.

    cut: holds names, which may be shortened, at the front when keep_end.  optional: may be left out, the highest
    number first.  short: title to use where the page is narrow.
    """

    title: str = ""
    align: Literal["l", "r"] = "l"
    cut: bool = False
    optional: int = 0
    style: str = ""
    short: str = ""
    keep_end: bool = False


@dataclass
class Grid:
    """A table without lines, indented.

    It fits the page by shortening titles, then by leaving out optional columns, then by cutting names.
    """

    columns: Sequence[Column]
    rows: list[tuple[list[Text], str]] = field(default_factory=list)
    indent: int = 2
    gap: int = _GAP

    def add(self, *cells: str | Text, style: str = "") -> None:
        """Append a row; missing cells at its end are empty."""
        texts = [cell if isinstance(cell, Text) else Text(cell) for cell in cells]
        self.rows.append((texts + [Text("")] * (len(self.columns) - len(texts)), style))

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        room = options.max_width - self.indent
        titles = [column.title for column in self.columns]
        if sum(self._natural(titles).values()) + self.gap * (len(titles) - 1) > room:
            titles = [column.short or column.title for column in self.columns]
        shown, widths = self._fit(room, self._natural(titles))
        if any(titles[c] for c in shown):
            yield self._line([Text(title) for title in titles], shown, widths, "dim")
        for cells, style in self.rows:
            yield self._line(cells, shown, widths, style)

    def _natural(self, titles: list[str]) -> dict[int, int]:
        """Width of each column's longest entry."""
        return {
            c: max([cell_len(title), *(cell_len(cells[c].plain) for cells, _ in self.rows)])
            for c, title in enumerate(titles)
        }

    def _fit(self, room: int, natural: dict[int, int]) -> tuple[list[int], dict[int, int]]:
        """The columns to show and their widths."""
        shown = list(natural)
        least = {c: min(w, _LEAST_NAME) if self.columns[c].cut else w for c, w in natural.items()}

        def needed(widths: dict[int, int]) -> int:
            return sum(widths[c] for c in shown) + self.gap * (len(shown) - 1)

        for c in sorted(natural, key=lambda c: -self.columns[c].optional):
            # A name cut to half its length says less than the column that could give it room.
            if self.columns[c].optional and needed({c: max(least[c], w * 2 // 3) for c, w in natural.items()}) > room:
                shown.remove(c)
        widths = dict(natural)
        while needed(widths) > room:
            cuttable = [c for c in shown if widths[c] > least[c]]
            if not cuttable:
                break
            widths[max(cuttable, key=lambda c: widths[c])] -= 1
        return shown, widths

    def _line(self, cells: Sequence[Text], shown: list[int], widths: dict[int, int], style: str) -> Text:
        line = Text(" " * self.indent, no_wrap=True, overflow="ignore", end="\n")
        for place, c in enumerate(shown):
            cell = cells[c].copy()
            if cell_len(cell.plain) > widths[c]:
                cell = Text(_cut(cell.plain, widths[c], keep_end=self.columns[c].keep_end), style=cell.style)
            blank = Text(" " * (widths[c] - cell_len(cell.plain)))
            cell.stylize_before(style or self.columns[c].style)
            line.append_text(blank + cell if self.columns[c].align == "r" else cell + blank)
            if place < len(shown) - 1:
                line.append(" " * self.gap)
        line.rstrip()
        return line


def _cut(text: str, width: int, *, keep_end: bool) -> str:
    """The text in `width` columns, with an ellipsis where some of it is missing."""
    if not keep_end:
        return set_cell_size(text, width - 1) + "…"
    while cell_len(text) > width - 1:
        text = text[1:]
    return f"…{text}"


def page_text(parts: Iterable[RenderableType], width: int, *, colour: bool) -> str:
    """The parts printed one below the other, without blanks at the end of lines."""
    stream = io.StringIO()
    console = Console(
        file=stream,
        width=width,
        force_terminal=colour,
        color_system="standard" if colour else None,
        no_color=not colour,
        highlight=False,
        markup=False,
        emoji=False,
        legacy_windows=False,
    )
    for part in parts:
        console.print(part, crop=False)  # a number is never cut, even on a page too narrow for it
    return "\n".join(line.rstrip() for line in stream.getvalue().splitlines()) + "\n"
