"""The map of the code: rooms as boxes, lines for what they import; alone it writes an SVG."""

from __future__ import annotations

import ast
from pathlib import Path

PACKAGE = Path(__file__).parent.parent / "hertzchain"

CORE = (
    "contact", "scene", "observables", "theory", "comparison",
    "external", "native", "lammps", "lammps.reading",
)  # fmt: skip
"""Rooms to read first; ``tests/test_rooms.py`` keeps them apart from all others."""

COMPARISON = ("check", "comparison", "run_checks")
"""Modules of ``verdict/`` that compare; the others judge what was computed elsewhere."""

PLACES = (
    "   cli", "  lab", "   sweeps", "   report", "   verdict known",
    " comparison", "  examiner pulses", "  slips",
    "theory native lammps liggghts yade", "  lammps.reading", " external", " observables",
    " scene", " contact",
)  # fmt: skip
"""Rooms row by row; what nearly every room imports, and the registry of engines, is not drawn."""

_WIDTH, _ROW = 160, 58


def room_of(module: str) -> str:
    """Return the room of a module, by its dotted name within the package."""
    parts = module.removeprefix("engines.").split(".")
    if parts[0] == "verdict":
        return "comparison" if parts[-1] in COMPARISON else "verdict"
    return "lammps.reading" if parts[:2] == ["lammps", "reading"] else parts[0]


def rooms() -> tuple[dict[str, int], dict[str, set[str]]]:
    """Return the lines of each room, and the rooms that each imports."""
    lines: dict[str, int] = {}
    imported: dict[str, set[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        room = room_of(".".join(path.relative_to(PACKAGE).with_suffix("").parts))
        lines[room] = lines.get(room, 0) + text.count("\n")
        named = (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom))
        rooms_above = {room_of(str(node.module).removeprefix("hertzchain.")) for node in named}
        imported[room] = imported.get(room, set()) | rooms_above
    return lines, imported


def draw() -> str:
    """Return the map as SVG; the core is blue, lines that follow from others are left out."""
    lines, imported = rooms()
    places = {
        room: (column * (_WIDTH + 8) + 4, row * _ROW + 4)
        for row, names in enumerate(PLACES)
        for column, room in enumerate(names.split(" "))
        if room
    }
    shapes: list[str] = []
    below: dict[str, set[str]] = {}  # rooms that a room imports, by others too
    for room, (x, y) in reversed(places.items()):
        direct = imported[room] & below.keys()
        further = set().union(*(below[other] for other in direct))
        below[room] = direct | further
        for other in sorted(direct - further):
            end, height = places[other]
            line = f'x1="{x + _WIDTH // 2}" y1="{y + 34}" x2="{end + _WIDTH // 2}" y2="{height}"'
            shapes.insert(0, f'<line {line} stroke="#888"/>')  # under the boxes
        fill = "#cfe3f5" if room in CORE else "#eeeeee"
        box = f'x="{x}" y="{y}" width="{_WIDTH}" height="34"'
        shapes.append(f'<rect {box} rx="4" fill="{fill}" stroke="#444"/>')
        middle = f'x="{x + _WIDTH // 2}" y="{y + 21}" text-anchor="middle"'
        shapes.append(f"<text {middle}>{room}, {round(lines[room], -2) or 100:,}</text>")
    columns = max(len(row.split(" ")) for row in PLACES)
    box = f'viewBox="0 0 {columns * (_WIDTH + 8)} {len(PLACES) * _ROW}"'
    font = 'font-size="13" font-family="sans-serif"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {box} {font}>{"".join(shapes)}</svg>'


if __name__ == "__main__":
    Path("code_map.svg").write_text(draw(), encoding="utf-8")
