"""Draw docs/package.svg, the imports between the parts of the package: python docs/draw_package.py

Entry points are at the top, rooms below them, foundations at the bottom. Every arrow points down, from the part that
imports to the part that is imported, and passes behind parts that it does not concern. The imports are read from the
text of all modules and scripts, so that the drawing shows what the code does; the lists below say what it should do,
and ``tests/test_architecture.py`` enforces them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from graphlib import TopologicalSorter
from pathlib import Path

from cospeech.kernels import code_hash

PACKAGE = code_hash.PACKAGE
ROOT = PACKAGE.parents[1]
DRAWING = Path(__file__).with_name("package.svg")

ENTRY_POINTS = ("api", "cli", "commands", "live", "viewer", "scripts")
"""What may import several rooms; ``scripts`` is the folder of that name next to ``src``."""

ROOMS = (
    "studio", "corpus", "capture", "speech", "segmentation",
    "synthesis", "identity", "rendering", "evaluation", "report",
)  # fmt: skip
"""One processing stage each, in the order in which data passes through them. None imports another."""

FOUNDATIONS = ("data", "errors", "formats", "geometry", "kernels", "markov", "metrics", "motion", "workflow")
"""Used by all parts. They import no room, and one another without cycles."""

COLOURS = {
    "studio": "#c77c3c", "corpus": "#7d9a3d", "capture": "#3f9a6c", "speech": "#3a93b8",
    "segmentation": "#6a78c8", "synthesis": "#b0589a", "identity": "#8c6bb5", "rendering": "#b8962e",
    "evaluation": "#4b8f98", "report": "#b5605a",
}  # fmt: skip
GREY = "#8a93a0"

Imports = Mapping[str, frozenset[str]]


def part(path: Path) -> str | None:
    """Return the part of the package that a file belongs to; None for the package's own ``__init__``."""
    if not path.is_relative_to(PACKAGE):
        return "scripts"
    name = path.relative_to(PACKAGE).with_suffix("").parts[0]
    return None if name == "__init__" else name


def read_imports() -> Imports:
    """Return what each part of the package, and the scripts, import of other parts."""
    found: dict[str, set[str]] = {}
    for path in [*PACKAGE.rglob("*.py"), *(ROOT / "scripts").rglob("*.py")]:
        importer = part(path)
        if importer is not None:
            names = {part(file) for file in code_hash.imports(path)} - {None, importer}
            found.setdefault(importer, set()).update(name for name in names if name is not None)
    return {name: frozenset(found[name]) for name in sorted(found)}


def by_level(names: Iterable[str], imports: Imports) -> list[str]:
    """Return ``names`` from those that import the others to those that import none of them.

    Raises
    ------
    graphlib.CycleError : if there is no such order.
    """
    level: dict[str, int] = {}
    known = set(names)
    for name in TopologicalSorter({name: sorted(imports[name] & known) for name in sorted(known)}).static_order():
        level[name] = 1 + max((level[other] for other in imports[name] & known), default=0)
    return sorted(known, key=lambda name: (-level[name], name))


MARGIN, RADIUS = 24, 7
LABELS = 132
"""Width of the names at the left of the bars."""
PITCH, BOX = 70, 120
"""Distance of the rooms' columns, and width of a room, which stand in two rows."""
LANE = 20
"""Distance of the columns in which arrows from bar to bar run, at the right."""
BAR, GAP, ROOM = 26, 17, 34

STYLE = """
.ground{fill:#fbfaf7}.bar{fill:#eceae3;stroke:#c9c5b8}.name{fill:#1d2733}.note{fill:#6b7480}.box{fill:#fbfaf7}
@media (prefers-color-scheme:dark){
.ground{fill:#171b21}.bar{fill:#262c35;stroke:#3c4552}.name{fill:#e8eaed}.note{fill:#9aa4b1}.box{fill:#171b21}}
text{font-family:Helvetica,Arial,sans-serif}.name{font-size:15px;font-weight:bold}.note{font-size:12.5px}
"""


class Canvas:
    """The elements of a drawing: lines behind bars and boxes, and the ends of arrows in front of them."""

    def __init__(self, width: float) -> None:
        self.width = width
        self.behind: list[str] = []
        self.parts: list[str] = []
        self.heads: list[str] = []

    def note(self, x: float, y: float, text: str) -> None:
        """Write a remark that starts at (x, y)."""
        self.parts.append(f'<text class="note" x="{x:g}" y="{y:g}">{text}</text>')

    def bar(self, y: float, name: str) -> None:
        """Draw a part that spans the whole width."""
        width = self.width - 2 * MARGIN
        self.parts.append(
            f'<rect class="bar" x="{MARGIN}" y="{y:g}" width="{width:g}" height="{BAR}" rx="{RADIUS}"/>'
            f'<text class="name" x="{MARGIN + 14}" y="{y + BAR / 2 + 5:g}">{name}</text>'
        )

    def room(self, x: float, y: float, name: str) -> None:
        """Draw a room with its middle at x."""
        colour = COLOURS[name]
        shape = f'x="{x - BOX / 2:g}" y="{y:g}" width="{BOX}" height="{ROOM}" rx="{RADIUS}"'
        self.parts.append(
            f'<rect class="box" {shape}/><rect {shape} fill="{colour}" fill-opacity=".22" stroke="{colour}" '
            f'stroke-width="1.5"/><text class="name" x="{x:g}" y="{y + ROOM / 2 + 5:g}" '
            f'text-anchor="middle">{name}</text>'
        )

    def dot(self, x: float, y: float) -> None:
        """Mark the start of the arrows of a bar."""
        self.heads.append(f'<circle cx="{x:g}" cy="{y:g}" r="3.2" fill="{GREY}"/>')

    def arrows(self, x: float, start: float, tips: Iterable[float], colour: str, cell: int = 0) -> None:
        """Draw a line down from (x, start), with an arrowhead at each of ``tips``.

        The bar below each tip is tinted over a width of ``cell``.
        """
        ends = sorted(tips)
        if ends:
            self.behind.append(f'<path d="M{x:g} {start:g}V{ends[-1] - 4:g}" stroke="{colour}" stroke-width="1.6"/>')
        for end in ends:
            self.heads.append(f'<path d="M{x:g} {end:g}l-4.5 -8h9z" fill="{colour}"/>')
            if cell:
                self.heads.append(
                    f'<rect x="{x - cell / 2:g}" y="{end:g}" width="{cell}" height="{BAR}" '
                    f'fill="{colour}" fill-opacity=".3"/>'
                )


def draw(imports: Imports) -> str:
    """Return the drawing as SVG."""
    entries = by_level((name for name in ENTRY_POINTS if name in imports), imports)
    rooms = [name for name in ROOMS if name in imports]
    foundations = by_level((name for name in FOUNDATIONS if name in imports), imports)
    bars = [*entries, *foundations]
    column = {name: MARGIN + LABELS + PITCH * (place + 0.8) for place, name in enumerate(rooms)}
    importing = [name for name in bars if imports[name] & set(bars)]
    edge = max(column.values(), default=MARGIN + LABELS) + BOX / 2
    lane = {name: edge + LANE * (place + 1) for place, name in enumerate(importing)}
    canvas = Canvas(edge + LANE * (len(importing) + 1) + MARGIN)
    top: dict[str, float] = {}
    y = MARGIN + 10.0
    canvas.note(MARGIN, y, "entry points may import everything below")
    y += 10
    for name in entries:
        top[name] = y
        canvas.bar(y, name)
        y += BAR + GAP
    y += 4
    rows = (y, y + ROOM + 12)
    canvas.note(MARGIN, rows[0] + ROOM / 2, "rooms do not")
    canvas.note(MARGIN, rows[0] + ROOM / 2 + 16, "import one another")
    for place, name in enumerate(rooms):
        top[name] = rows[place % 2]
        canvas.room(column[name], top[name], name)
    y = rows[1] + ROOM + 32
    canvas.note(MARGIN, y, "foundations import no room")
    y += 12
    for name in foundations:
        top[name] = y
        canvas.bar(y, name)
        y += BAR + GAP
    height = y - GAP + MARGIN

    for place, name in enumerate(entries):
        shift = 6 * (place - (len(entries) - 1) / 2)
        for room in rooms:
            if room in imports[name]:
                canvas.arrows(column[room] + shift, top[name] + BAR, [top[room]], GREY)
    for room in rooms:
        ends = [top[name] for name in foundations if name in imports[room]]
        canvas.arrows(column[room], top[room] + ROOM, ends, COLOURS[room], 26)
    for name in importing:
        ends = [top[other] for other in bars if other in imports[name]]
        canvas.arrows(lane[name], top[name] + BAR, ends, GREY, 14)
        canvas.dot(lane[name], top[name] + BAR)
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {canvas.width:g} {height:g}" role="img" '
            'aria-label="The parts of the package cospeech, and what each imports">',
            f"<style>{STYLE}</style>",
            f'<rect class="ground" width="{canvas.width:g}" height="{height:g}" rx="14"/>',
            *canvas.behind,
            *canvas.parts,
            *canvas.heads,
            "</svg>\n",
        ]
    )


if __name__ == "__main__":
    DRAWING.write_text(draw(read_imports()), encoding="utf-8")
