"""Tables that never cut off text: if the columns do not fit side by side, each row becomes a block of lines."""

from rich import table
from rich.console import Console, ConsoleOptions, RenderResult
from rich.measure import Measurement
from rich.text import Text

GAP = 2
"""Blanks between two columns."""
PROSE = 10
"""Least width of a column without digits; longer texts there are folded, even inside a word."""
INDENT = 2
"""Indentation of the lines below the first cell of a block."""


class Table(table.Table):
    """A table without lines, its first column to the left and the others to the right.

    On a wide terminal each column has its natural width. On a narrower one cells are folded between words. If even the
    longest words do not fit side by side, every row is a block: the first cell, and below it lines `header: value`.
    """

    def __init__(self, title: str, *headers: str):
        super().__init__(
            title=title, title_justify="left", title_style="bold", header_style="bold", box=None, pad_edge=False
        )
        for i, header in enumerate(headers):
            self.add_column(header, justify="left" if i == 0 else "right", overflow="fold")

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Columns, or blocks."""
        widths = self._fitted(console, options)
        if widths is None:
            yield from self._blocks(console)
            return
        for column, width in zip(self.columns, widths, strict=True):
            column.width = width
        try:
            yield from super().__rich_console__(console, options)
        finally:
            for column in self.columns:
                column.width = None

    def _fitted(self, console: Console, options: ConsoleOptions) -> list[int | None] | None:
        """Widths that cut off no number, as near to the natural ones as the room allows; None if there is too
        little."""
        wide = options.update(width=10**6)
        measured = [
            [Measurement.get(console, wide, cell) for cell in (column.header, *column.cells)] for column in self.columns
        ]
        least = [max(cell.minimum for cell in cells) for cells in measured]
        for i, column in enumerate(self.columns):
            if not any(character.isdigit() for cell in column.cells for character in str(cell)):
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
