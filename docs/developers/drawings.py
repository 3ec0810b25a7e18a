#!/usr/bin/env python3
"""Draws rooms.svg, the rooms of the source and who includes whom, from the table of docs/architecture.md; and frame.svg, the
path of one frame.

    docs/developers/drawings.py            # write both
    docs/developers/drawings.py --check    # write nothing; exit code 1 if a drawing is out of date
"""

import argparse
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
COLOURS = {"physics": "#cfe3f3", "render": "#d5eddb", "engine": "#fbe6c8", "app": "#ecd9ee"}
FONT = 'font-family="DejaVu Sans, Verdana, sans-serif"'
BOX, HEIGHT, GAP, LEVEL = 132, 34, 18, 84


def rooms():
    """Of each room the rooms that it may include."""
    text = (HERE.parent / "architecture.md").read_text()
    table = re.findall(r"^\| `([\w/]+)` \| `\w+` \| .* \| ([^|]+) \|$", text, re.M)
    names = [name for name, _ in table]
    found = {}
    for name, may in table:
        words = [] if may.strip() == "–" else [word.strip() for word in may.split(",")]
        found[name] = set()
        for word in words:
            if word in ("physics", "render"):
                found[name] |= {one for one in names if one.startswith(word + "/")}
            else:
                ends = [one for one in names if one == word or one.endswith("/" + word)]
                if not ends:
                    raise SystemExit(f"docs/architecture.md: '{name}' may include '{word}', which is no room")
                found[name].add(min(ends, key=len))
        found[name].discard(name)
    return found


def reach(found, name, seen=None):
    seen = set() if seen is None else seen
    for one in found[name]:
        if one not in seen:
            seen.add(one)
            reach(found, one, seen)
    return seen


def reduced(found):
    """Without what follows from the rest: an arrow is left out if another path leads there."""
    return {name: {one for one in may if not any(one in reach(found, other) for other in may - {one})}
            for name, may in found.items()}


def level(found, name):
    return 1 + max((level(found, one) for one in found[name]), default=-1)


def text(x, y, words, size=13, weight="normal", anchor="middle", colour="#222"):
    words = words.replace("&", "&amp;").replace("<", "&lt;")
    return f'<text x="{x:g}" y="{y:g}" {FONT} font-size="{size}" font-weight="{weight}" text-anchor="{anchor}" fill="{colour}">{words}</text>'


def box(x, y, words, fill, width=BOX, height=HEIGHT):
    made = [f'<rect x="{x:g}" y="{y:g}" width="{width}" height="{height}" rx="5" fill="{fill}" stroke="#666"/>']
    lines = words.split("\n")
    for k, line in enumerate(lines):
        made.append(text(x + width / 2, y + height / 2 + 4.5 + 15 * (k - (len(lines) - 1) / 2), line, 12 if len(lines) > 1 else 13))
    return made


def svg(width, height, body):
    return "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}">',
                      f'<rect width="{width:g}" height="{height:g}" fill="white"/>',
                      '<defs><marker id="a" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
                      '<path d="M0 0 8 4 0 8z" fill="#555"/></marker></defs>', *body, "</svg>"]) + "\n"


def draw_rooms():
    found = rooms()
    arrows = reduced(found)
    rows = {}
    for name in found:
        rows.setdefault(level(found, name), []).append(name)
    most = max(len(row) for row in rows.values())
    width, top = most * (BOX + GAP) + 40, 60
    place, order = {}, {}
    for height in sorted(rows):
        row = rows[height]
        below = lambda one: [order[other] for other in arrows[one] if other in order]
        row.sort(key=lambda one: (sum(below(one)) / len(below(one)) if below(one) else 0, one))
        start = (width - len(row) * (BOX + GAP) + GAP) / 2
        for k, one in enumerate(row):
            place[one] = (start + k * (BOX + GAP), top + (len(rows) - 1 - height) * LEVEL)
            order[one] = place[one][0]
    body = []
    for name, may in arrows.items():
        x, y = place[name][0] + BOX / 2, place[name][1] + HEIGHT
        for one in sorted(may):
            to_x, to_y = place[one][0] + BOX / 2, place[one][1]
            bend = (to_y - y) / 2
            body.append(f'<path d="M{x:g} {y:g}C{x:g} {y + bend:g} {to_x:g} {to_y - bend:g} {to_x:g} {to_y - 2:g}" fill="none" '
                        'stroke="#555" stroke-width="1" opacity="0.7" marker-end="url(#a)"/>')
    for name, (x, y) in place.items():
        folder, _, last = name.rpartition("/")
        body += box(x, y, f"{folder}/\n{last}" if len(name) > 17 else name, COLOURS[name.split("/")[0]])
    body.append(text(width / 2, 24, "Rooms: an arrow means 'may include'; what follows from other arrows is left out", 14, "bold"))
    return svg(width, top + len(rows) * LEVEL - LEVEL + HEIGHT + 20, body)


def draw_frame():
    """A fixed drawing: places in a grid of columns and rows."""
    parts = {
        "script": (0, 0, "CommandScript\na file's commands", "engine"), "hands": (0, 1, "room::Hands\nkeys and sticks", "engine"),
        "exercise": (1, 0.5, "Exercise\n::next_frame", "engine"),
        "simulation": (2, 0, "Simulation::step\nmotions, contrast", "engine"), "console": (2, 1, "Console\narm, table, beam", "engine"),
        "hub": (3, -1, "physics::Hub\nequilibrium", "physics"),
        "frame": (3, 0.5, "Frame\ntime, events", "engine"),
        "judge": (4, -0.3, "Scorer, RoomReadout\nNotices, truth", "engine"),
        "monitor": (4, 1, "Monitor\n::take", "engine"), "fluoroscope": (5, 1, "Fluoroscope\nlengths to pixels", "render"),
        "files": (5, -0.3, "run: score,\nrecording", "engine"), "picture": (6, 1, "PNG, panel\nor window", "app"),
    }
    lines = [("script", "exercise"), ("hands", "exercise"), ("exercise", "simulation"), ("exercise", "console"),
             ("simulation", "hub"), ("simulation", "frame"), ("console", "frame"), ("frame", "judge"), ("frame", "monitor"),
             ("monitor", "fluoroscope"), ("judge", "files"), ("fluoroscope", "picture")]
    wide, tall, across, down = 140, 46, 172, 84
    at = {name: (20 + column * across, 140 + row * down) for name, (column, row, _, _) in parts.items()}
    body = []
    for one, other in lines:
        (x, y), (to_x, to_y) = at[one], at[other]
        body.append(f'<path d="M{x + wide:g} {y + tall / 2:g}C{x + wide + 16:g} {y + tall / 2:g} {to_x - 16:g} {to_y + tall / 2:g} '
                    f'{to_x - 2:g} {to_y + tall / 2:g}" fill="none" stroke="#555" marker-end="url(#a)"/>')
    for name, (_, _, words, folder) in parts.items():
        body += box(*at[name], words, COLOURS[folder], wide, tall)
    width = 40 + 6 * across + wide
    body.append(text(width / 2, 26, "One frame", 15, "bold"))
    return svg(width, 300, body)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true")
    check = parser.parse_args().check
    made = {"rooms.svg": draw_rooms(), "frame.svg": draw_frame()}
    wrong = [name for name, drawing in made.items() if not (HERE / name).exists() or (HERE / name).read_text() != drawing]
    for name in wrong:
        if check:
            print(f"docs/developers/{name} is out of date: run docs/developers/drawings.py")
        else:
            (HERE / name).write_text(made[name])
    return 1 if check and wrong else 0


if __name__ == "__main__":
    sys.exit(main())
