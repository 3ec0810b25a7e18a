#!/usr/bin/env python3
"""docs/pictures/c_arm.py: draws c-arm.svg, the angles and distances of the C-arm, for docs/trainee/angiography.md."""

import math
import pathlib

OUT = pathlib.Path(__file__).with_name("c-arm.svg")
STYLE = ("text{font:14px 'DejaVu Sans',sans-serif;fill:#1c2733}.h{font-weight:bold;font-size:15px}"
         ".s{font-size:12px;fill:#4a5a68}.l{stroke:#1c2733;stroke-width:1.5;fill:none}"
         ".d{stroke:#b35900;stroke-width:1.5;fill:none;stroke-dasharray:5 3}")


def gantry(x, y, angle_deg, radius=105):
    """The C with its source and detector, turned clockwise by an angle about (x, y)."""
    arc = (f'<path d="M 0 {-radius} A {radius} {radius} 0 0 0 0 {radius}" stroke="#7a8a99" stroke-width="9" fill="none"/>')
    beam = f'<path d="M 0 {radius - 8} L -38 {-radius + 16} L 38 {-radius + 16} Z" fill="#ffd23f" opacity="0.45"/>'
    heads = (f'<rect x="-44" y="{-radius - 2}" width="88" height="16" fill="#33475b"/>'
             f'<rect x="-13" y="{radius - 12}" width="26" height="22" fill="#b35900"/>')
    return f'<g transform="translate({x} {y}) rotate({angle_deg})">{arc}{beam}{heads}</g>'


def from_feet(x, y):
    """A patient's trunk on the table, seen from the feet: the patient's left is on the right."""
    return (f'<ellipse cx="{x}" cy="{y}" rx="58" ry="30" fill="#d8b79c" stroke="#8a6a50"/>'
            f'<circle cx="{x}" cy="{y + 18}" r="8" fill="#f3e9da" stroke="#8a6a50"/>'
            f'<rect x="{x - 80}" y="{y + 31}" width="160" height="6" fill="#4a5a68"/>'
            f'<text x="{x - 76}" y="{y + 5}">R</text><text x="{x + 66}" y="{y + 5}">L</text>')


def from_side(x, y):
    """A patient on the table, seen from the right side: the head is on the left."""
    return (f'<circle cx="{x - 88}" cy="{y + 4}" r="19" fill="#d8b79c" stroke="#8a6a50"/>'
            f'<rect x="{x - 66}" y="{y - 20}" width="150" height="44" rx="18" fill="#d8b79c" stroke="#8a6a50"/>'
            f'<rect x="{x - 112}" y="{y + 26}" width="224" height="6" fill="#4a5a68"/>'
            f'<text x="{x - 124}" y="{y + 52}">head</text><text x="{x + 90}" y="{y + 5}">feet</text>')


def turned(x, y, from_deg, to_deg, radius=130):
    """An arrow round (x, y), by angles from straight up, clockwise."""
    def at(angle):
        return x + radius * math.sin(math.radians(angle)), y - radius * math.cos(math.radians(angle))
    (x0, y0), (x1, y1) = at(from_deg), at(to_deg)
    return (f'<path d="M {x0:.1f} {y0:.1f} A {radius} {radius} 0 0 {int(to_deg > from_deg)} {x1:.1f} {y1:.1f}" class="l" '
            'marker-end="url(#arrow)"/>')


def words(x, y, *lines, kind=""):
    """Lines of text, the first in bold."""
    parts = [f'<text class="h" x="{x}" y="{y}" text-anchor="middle">{lines[0]}</text>']
    parts += [f'<text class="s" x="{x}" y="{y + 18 * k}" text-anchor="middle">{line}</text>' for k, line in enumerate(lines[1:], 1)]
    return "".join(parts)


def distances(x, y):
    """SID and SOD beside an upright C-arm."""
    def measure(at, top, bottom, name):
        return (f'<path d="M {at} {top} L {at} {bottom}" class="d" marker-start="url(#back)" marker-end="url(#arrow2)"/>'
                f'<text x="{at + 8}" y="{top + 0.3 * (bottom - top)}">{name}</text>')
    return (measure(x + 95, y - 94, y + 99, "SID") + measure(x + 150, y, y + 99, "SOD")
            + f'<path d="M {x} {y} L {x + 150} {y}" class="d"/><circle cx="{x}" cy="{y}" r="4" fill="#b3001b"/>'
            f'<path d="M {x} {y + 99} L {x + 150} {y + 99}" class="d"/><path d="M {x + 44} {y - 94} L {x + 95} {y - 94}" class="d"/>')


def main():
    body = []
    for k, (angle, head, arrow) in enumerate([(35, ("LAO 35°", "detector over the patient's left"), (5, 32)),
                                             (-35, ("RAO 35°", "detector over the patient's right"), (-5, -32))]):
        x, y = 165 + 330 * k, 190
        body += [gantry(x, y, angle), from_feet(x, y), turned(x, y, *arrow), words(x, 345, *head, "seen from the feet")]
    for k, (angle, head, arrow) in enumerate([(-25, ("CRAN 25°", "detector toward the head"), (-4, -22)),
                                             (25, ("CAUD 25°", "detector toward the feet"), (4, 22))]):
        x, y = 165 + 330 * k, 545
        body += [gantry(x, y, angle), from_side(x, y), turned(x, y, *arrow), words(x, 700, *head, "seen from the patient's right")]
    x, y = 790, 190
    body += [gantry(x, y, 0), from_feet(x, y), distances(x, y),
             words(x + 20, 345, "Distances", "SID: source to detector", "SOD: source to the centre of rotation (red)")]
    body += [f'<rect x="700" y="440" width="44" height="22" fill="#33475b"/><text x="755" y="457">detector</text>',
             f'<rect x="709" y="480" width="26" height="22" fill="#b35900"/><text x="755" y="497">X-ray source</text>',
             f'<rect x="700" y="520" width="44" height="22" fill="#ffd23f" opacity="0.6"/><text x="755" y="537">beam</text>']
    marker = ('<marker id="{}" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8" markerHeight="8" orient="{}">'
              '<path d="M 0 0 L 10 5 L 0 10 Z" fill="{}"/></marker>')
    OUT.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1000 760" width="1000" height="760">\n'
        f"<style>{STYLE}</style><defs>{marker.format('arrow', 'auto', '#1c2733')}{marker.format('arrow2', 'auto', '#b35900')}"
        f"{marker.format('back', 'auto-start-reverse', '#b35900')}</defs>\n"
        '<rect width="1000" height="760" fill="#ffffff"/>\n' + "\n".join(body) + "\n</svg>\n")


if __name__ == "__main__":
    main()
