"""A printed grid for `tricoil calibrate grid`: one page of A4 at true scale, and the table of its nodes."""

import dataclasses

from ._model import _positive

PAGE_MM = (297.0, 210.0)  # A4, landscape
MARGIN_MM = 15.0
RULER_MM = 200
RULER_Y_MM = 12.0
GRID_MM = (PAGE_MM[0] - 2 * MARGIN_MM, PAGE_MM[1] - 45.0)  # room for nodes: the ruler is below, the title above
LEAST_SPACING_MM = 10.0
BEYOND_MM = 3.0  # of the lines beyond the outer nodes


@dataclasses.dataclass(frozen=True)
class Page:
    """Nodes in the order of `calibrate grid --nodes`: columns change fastest."""

    spacing_mm: float
    columns: int
    rows: int
    corner_mm: tuple[float, float]  # of node 0, 0 on the page, from the lower left

    def nodes(self):
        """(number from 1, column, row, x from node 0, 0 in mm, y)."""
        return [(1 + row * self.columns + column, column, row, column * self.spacing_mm, row * self.spacing_mm)
                for row in range(self.rows) for column in range(self.columns)]


def layout(spacing_mm=None) -> Page:
    """As many nodes as the page has room for. Raises ValueError for a spacing that is too small, or too large for 2 x 2 nodes."""
    spacing = 40.0 if spacing_mm is None else _positive("--spacing-mm", spacing_mm)
    if not LEAST_SPACING_MM <= spacing <= min(GRID_MM):
        raise ValueError(f"--spacing-mm: must be {LEAST_SPACING_MM:g} to {min(GRID_MM):g} for a page of A4; is {spacing:g}")
    columns, rows = (int(room / spacing + 1e-9) + 1 for room in GRID_MM)
    left = (PAGE_MM[0] - (columns - 1) * spacing) / 2
    bottom = 27.0 + (GRID_MM[1] - (rows - 1) * spacing) / 2
    return Page(spacing, columns, rows, (left, bottom))


def table(page: Page) -> str:
    """CSV. With the couplings of one attitude in each row, x11 to x33 beside these columns, `calibrate grid` reads it."""
    rows = [f"{number},{column},{row},0,{x:.10g},{y:.10g}" for number, column, row, x, y in page.nodes()]
    return "\n".join(["number,column,row,level,x_mm,y_mm", *rows]) + "\n"


def draw(page: Page):
    """A figure of matplotlib in the size of the page; one unit is 1 mm."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=[length / 25.4 for length in PAGE_MM])
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, PAGE_MM[0]), ylim=(0, PAGE_MM[1]))
    axes.axis("off")
    left, bottom = page.corner_mm
    width, height = (page.columns - 1) * page.spacing_mm, (page.rows - 1) * page.spacing_mm
    for column in range(page.columns):
        axes.plot(2 * [left + column * page.spacing_mm], [bottom - BEYOND_MM, bottom + height + BEYOND_MM], "k", lw=0.3)
    for row in range(page.rows):
        axes.plot([left - BEYOND_MM, left + width + BEYOND_MM], 2 * [bottom + row * page.spacing_mm], "k", lw=0.3)
    size = 10 if page.spacing_mm >= 25 else 6
    for number, column, row, x, y in page.nodes():
        axes.text(left + x + 1, bottom + y + 1, str(number), fontsize=size)
        if page.spacing_mm >= 25:
            axes.text(left + x + 1, bottom + y - 1, f"{column},{row}", fontsize=6, va="top", color="0.4")
    axes.text(PAGE_MM[0] / 2, PAGE_MM[1] - 12, f"tricoil: {page.columns} x {page.rows} nodes, {page.spacing_mm:g} mm apart. Number above, column,row below.",
              ha="center", fontsize=11)
    _ruler(axes)
    return figure


def _ruler(axes):
    begin = (PAGE_MM[0] - RULER_MM) / 2
    axes.plot([begin, begin + RULER_MM], 2 * [RULER_Y_MM], "k", lw=0.5)
    for n in range(0, RULER_MM + 1, 10):
        axes.plot(2 * [begin + n], [RULER_Y_MM, RULER_Y_MM + (4 if n % 50 == 0 else 2)], "k", lw=0.5)
        if n % 50 == 0:
            axes.text(begin + n, RULER_Y_MM + 5, f"{n}", ha="center", fontsize=7)
    axes.text(PAGE_MM[0] / 2, RULER_Y_MM - 5, f"Print at 100 %, without fitting to the page. This ruler must measure {RULER_MM} mm.", ha="center", fontsize=8)


def result(page: Page, file: str, nodes_file: str) -> dict:
    return {"grid": file, "nodes": nodes_file, "spacing_mm": page.spacing_mm, "columns": page.columns, "rows": page.rows}


def text(found: dict) -> str:
    return (f"{found['grid']}: {found['columns']} x {found['rows']} nodes, {found['spacing_mm']:g} mm apart; print at 100 % and measure the ruler\n"
            f"{found['nodes']}: column, row and level of each node; add couplings x11 to x33 of several attitudes at each, then\n"
            f"  tricoil calibrate grid --spacing-mm {found['spacing_mm']:g} --out cal.toml TABLE\n")
