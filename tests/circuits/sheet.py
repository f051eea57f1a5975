"""Symbols of a schematic as SVG. Coordinates in pixels; parts lie between two points of a horizontal or vertical line."""
import html

STYLE = """
.w { fill: none; stroke: #24384f; stroke-width: 1.5 }
.p { fill: #ffffff; stroke: #24384f; stroke-width: 1.5 }
.d { fill: #24384f }
.b { fill: #eef3f9; stroke: #24384f; stroke-width: 1.5 }
.v { font-size: 12px; fill: #14202e }
.n { font-size: 12px; fill: #5a2d2d }
.h { font-size: 18px; font-weight: bold; fill: #111 }
.o { font-size: 11px; font-weight: bold; fill: #111 }
.t { font-size: 12px; font-weight: bold; fill: #111 }
.s { font-size: 10px; fill: #4a5a6a }
.f { font-size: 12px; font-weight: bold; fill: #0b4f8a }
"""

LEFT = 40  # room to the left of x = 0


class Sheet:
    def __init__(self, width, height, title):
        self.size = (width, height)
        self.parts = []
        self.title = title
        self.text(-20, 30, title, "h")

    def svg(self):
        w, h = self.size
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{-LEFT} 0 {w + LEFT} {h}" width="{w + LEFT}" height="{h}" '
                f'font-family="Helvetica, Arial, sans-serif">\n<title>{html.escape(self.title)}</title>\n<style>{STYLE}</style>\n'
                f'<rect x="{-LEFT}" width="{w + LEFT}" height="{h}" fill="#ffffff"/>\n' + "\n".join(self.parts) + "\n</svg>\n")

    def text(self, x, y, words, kind="v", anchor="start"):
        for k, line in enumerate(words.split("\n")):
            self.parts.append(f'<text class="{kind}" x="{x}" y="{y + 15 * k}" text-anchor="{anchor}">{html.escape(line)}</text>')

    def wire(self, *points):
        self.parts.append('<polyline class="w" points="' + " ".join(f"{x},{y}" for x, y in points) + '"/>')

    def dot(self, *points):
        for x, y in points:
            self.parts.append(f'<circle class="d" cx="{x}" cy="{y}" r="3.2"/>')

    def _path(self, d, kind="w"):
        self.parts.append(f'<path class="{kind}" d="{d}"/>')

    def _label(self, a, b, words, side, kind="part"):
        (x1, y1), (x2, y2) = a, b
        mx, my = (x1 + x2) / 2, (y1 + y2) / 2
        lines = words.count("\n")
        away = 14 if kind == "part" else 19
        if y1 == y2:
            self.text(mx, my + 24 if side == "below" else my - (13 if kind == "part" else 18) - 15 * lines, words, anchor="middle")
        elif side == "left":
            self.text(mx - away, my + 4 - 7.5 * lines, words, anchor="end")
        else:
            self.text(mx + away, my + 4 - 7.5 * lines, words)

    def _leads(self, a, b, half):
        """Draws the wires to a symbol in the middle; returns its centre and the unit vector along it."""
        (x1, y1), (x2, y2) = a, b
        mx, my = (x1 + x2) / 2, (y1 + y2) / 2
        length = abs(x2 - x1) + abs(y2 - y1)
        ux, uy = (x2 - x1) / length, (y2 - y1) / length
        self.wire(a, (mx - half * ux, my - half * uy))
        self.wire((mx + half * ux, my + half * uy), b)
        return mx, my, ux, uy

    def resistor(self, a, b, words, side="right"):
        mx, my, ux, _ = self._leads(a, b, 18)
        w, h = (36, 14) if ux else (14, 36)
        self.parts.append(f'<rect class="p" x="{mx - w / 2}" y="{my - h / 2}" width="{w}" height="{h}"/>')
        self._label(a, b, words, side)

    def capacitor(self, a, b, words, side="right"):
        mx, my, ux, uy = self._leads(a, b, 4)
        for s in (-4, 4):
            self.wire((mx + s * ux - 13 * uy, my + s * uy - 13 * ux), (mx + s * ux + 13 * uy, my + s * uy + 13 * ux))
        self._label(a, b, words, side, "capacitor")

    def diode(self, anode, cathode, words="", side="right", schottky=False):
        mx, my, ux, uy = self._leads(anode, cathode, 8)
        tip, base = (mx + 8 * ux, my + 8 * uy), (mx - 8 * ux, my - 8 * uy)
        left, right = (base[0] - 8 * uy, base[1] - 8 * ux), (base[0] + 8 * uy, base[1] + 8 * ux)
        self._path(f"M{left[0]} {left[1]} L{right[0]} {right[1]} L{tip[0]} {tip[1]} z", "p")
        bar = [(tip[0] - 9 * uy, tip[1] - 9 * ux), (tip[0] + 9 * uy, tip[1] + 9 * ux)]
        if schottky:
            bar = [(bar[0][0] + 4 * ux, bar[0][1] + 4 * uy), *bar, (bar[1][0] - 4 * ux, bar[1][1] - 4 * uy)]
        self.wire(*bar)
        if words:
            self._label(anode, cathode, words, side)

    def opamp(self, x, y, words, plus_above=False, size=40):
        """Inputs at (x, y -+ size/2), output at (x + 2 size, y)."""
        self._path(f"M{x} {y - size} L{x} {y + size} L{x + 2 * size} {y} z", "p")
        signs = ("+", "-") if plus_above else ("-", "+")
        self.text(x + 6, y - size / 2 + 5, signs[0], "t")
        self.text(x + 6, y + size / 2 + 5, signs[1], "t")
        self.text(x + 5, y + 3.5, words, "o")

    def pnp(self, x, y, words):
        """Base at (x, y), emitter at (x + 30, y - 30), collector at (x + 30, y + 30)."""
        self.wire((x, y), (x + 14, y))
        self.wire((x + 14, y - 16), (x + 14, y + 16))
        self.wire((x + 30, y - 30), (x + 30, y - 20), (x + 14, y - 7))
        self.wire((x + 14, y + 7), (x + 30, y + 20), (x + 30, y + 30))
        self._path(f"M{x + 14} {y - 7} l4 -8 l5 6 z", "d")
        self.text(x + 38, y + 4, words, "t")

    def npn(self, x, y, words):
        """Base at (x, y), collector at (x + 30, y - 30), emitter at (x + 30, y + 30)."""
        self.wire((x, y), (x + 14, y))
        self.wire((x + 14, y - 16), (x + 14, y + 16))
        self.wire((x + 30, y - 30), (x + 30, y - 20), (x + 14, y - 7))
        self.wire((x + 14, y + 7), (x + 30, y + 20), (x + 30, y + 30))
        self._path(f"M{x + 30} {y + 20} l-4 -8 l-5 6 z", "d")
        self.text(x + 38, y + 4, words, "t")

    def ground(self, x, y):
        self.wire((x, y), (x, y + 8))
        for half, low in ((12, 8), (8, 12), (4, 16)):
            self.wire((x - half, y + low), (x + half, y + low))

    def supply(self, x, y, words, down=False):
        s = 1 if down else -1
        self.wire((x, y), (x, y + 8 * s), (x - 10, y + 8 * s), (x + 10, y + 8 * s))
        self.text(x, y + (22 if down else -13), words, "t", "middle")

    def note(self, x, y, words):
        self.text(x, y, words, "n")
