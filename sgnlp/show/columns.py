"""Tables that never cut off text: if the columns do not fit side by side, each row becomes a block of lines."""

import re
from collections.abc import Collection

from rich import table
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.text import Text

GAP = 2
"""Blanks between two columns."""
PROSE = 11
"""Least width of a column of prose or without digits; longer words there are folded, if they can be at a `_`."""
WORD = re.compile(r"\[[^]]*\]|\S+")
"""A word, or a unit such as [N m], which is not broken."""
INDENT = 2
"""Indentation of the lines below the first cell of a block."""


class Table(table.Table):
    """A table without lines, its first column to the left and the others to the right.

    On a wide terminal each column has its natural width. On a narrower one cells are folded between words. If even the
    longest words do not fit side by side, every row is a block: the first cell, and below it lines `header: value`.
    `prose` has the headers of columns of sentences, which may be narrow.
    """

    def __init__(self, title: str, *headers: str, prose: Collection[str] = ()):
        super().__init__(
            title=title, title_justify="left", title_style="bold", header_style="bold", box=None, pad_edge=False
        )
        self.prose = prose
        for i, header in enumerate(headers):
            self.add_column(header, justify="left" if i == 0 or header in prose else "right", overflow="fold")

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Columns, or blocks."""
        widths = self._fitted(console, options)
        if widths is None:
            yield from self._blocks(console)
            return
        yield Text(str(self.title), style="bold")  # a title may be wider than its table
        folded = Table("", *(str(column.header) for column in self.columns), prose=self.prose)
        for column, width in zip(folded.columns, widths, strict=True):
            column.width, column.header = width, _folded(column.header, width)
        for row, cells in zip(self.rows, zip(*(column.cells for column in self.columns), strict=True), strict=True):
            folded.add_row(*map(_folded, cells, widths), style=row.style)
        yield from table.Table.__rich_console__(folded, console, options)

    def _fitted(self, console: Console, options: ConsoleOptions) -> list[int | None] | None:
        """Widths that cut off no number, as near to the natural ones as the room allows; None if there is too
        little."""
        wide = options.update(width=10**6)
        measured = [
            [Measurement.get(console, wide, cell) for cell in (column.header, *column.cells)] for column in self.columns
        ]
        least = [max(cell.minimum for cell in cells) for cells in measured]
        for i, column in enumerate(self.columns):
            least[i] = max([least[i], *map(len, WORD.findall(str(column.header)))])
            digits = any(character.isdigit() for cell in column.cells for character in str(cell))
            if column.header in self.prose or not digits:
                least[i] = min(least[i], PROSE)
        wanted = [max(cell.maximum for cell in cells) for cells in measured]
        if sum(wanted) + GAP * (len(wanted) - 1) <= options.max_width:
            return [None] * len(wanted)
        room = options.max_width - sum(least) - GAP * len(least)  # some versions of Rich count the edges too
        if room < 0:
            return None
        widths: list[int | None] = list(least)
        for i in sorted(range(len(least)), key=lambda i: wanted[i] - least[i]):  # columns that lack least come first
            more = min(room, wanted[i] - least[i])
            widths[i], room = least[i] + more, room - more
        return widths

    def _blocks(self, console: Console) -> RenderResult:
        """The title, and the rows one below the other; empty cells are left out."""
        yield Text(str(self.title), style="bold")
        for cells in zip(*(column.cells for column in self.columns), strict=True):
            texts = [cell if isinstance(cell, Text) else console.render_str(str(cell)) for cell in cells]
            for i, (column, text) in enumerate(zip(self.columns, texts, strict=True)):
                if text.plain:
                    header = console.render_str(f"{column.header}: ", style="bold")
                    yield Text(" " * INDENT * (i > 0)).append_text(header).append_text(text)


def _folded(cell: RenderableType, width: int | None) -> RenderableType:
    """A text whose words that are wider than its column end a line at a `_`."""
    if width is None or not isinstance(cell, str):
        return cell
    lines = [""]
    for word in WORD.findall(cell):
        for piece in re.findall("[^_]*_|[^_]+", word) if len(word) > width else [word]:
            if lines[-1] and len(lines[-1] + piece) > width:
                lines[-1] = lines[-1].rstrip()
                lines.append("")
            lines[-1] += piece
        lines[-1] += " "
    return "\n".join(lines).rstrip()
