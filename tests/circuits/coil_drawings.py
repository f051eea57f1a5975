"""Drawings of the coils with dimensions, from coils.toml: sections of the triads, and the formers."""
import math

import formers
from sheet import Sheet
from winding import Triads

COLOURS = ("#b5651d", "#2f6f9f", "#4c8c4a")


class Plan(Sheet):
    """Sheet with shapes in mm about a centre: (px, py), pixels per mm."""

    def look(self, px, py, scale):
        self.place = lambda x, y: (px + scale * x, py - scale * y)
        self.scale = scale

    def shape(self, points, fill, stroke="#24384f", width=1.2):
        text = " ".join("{:.1f},{:.1f}".format(*self.place(x, y)) for x, y in points)
        self.parts.append(f'<polygon points="{text}" fill="{fill}" stroke="{stroke}" stroke-width="{width}"/>')

    def rectangle(self, x1, y1, x2, y2, fill, **style):
        self.shape([(x1, y1), (x2, y1), (x2, y2), (x1, y2)], fill, **style)

    def band(self, inner, outer, fill, stroke="#24384f"):
        """Area between two closed outlines."""
        path = " ".join("M" + " L".join("{:.1f} {:.1f}".format(*self.place(x, y)) for x, y in outline) + " z" for outline in (inner, outer))
        self.parts.append(f'<path d="{path}" fill="{fill}" fill-rule="evenodd" stroke="{stroke}" stroke-width="1"/>')

    def label(self, x, y, words, kind="v", anchor="start"):
        self.text(*(round(v, 1) for v in self.place(x, y)), words, kind, anchor)

    def dimension(self, a, b, words, anchor="middle", shift=(0, -6)):
        (x1, y1), (x2, y2) = self.place(*a), self.place(*b)
        length = math.hypot(x2 - x1, y2 - y1)
        ux, uy = (x2 - x1) / length, (y2 - y1) / length
        self.parts.append(f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="#777" stroke-width="1.1"/>')
        for x, y in ((x1, y1), (x2, y2)):
            self.parts.append(f'<line x1="{x - 5 * uy:.1f}" y1="{y + 5 * ux:.1f}" x2="{x + 5 * uy:.1f}" y2="{y - 5 * ux:.1f}" '
                              'stroke="#777" stroke-width="1.1"/>')
        self.text(round((x1 + x2) / 2 + shift[0], 1), round((y1 + y2) / 2 + shift[1], 1), words, "v", anchor)


def circle(radius, pieces=90):
    return [(radius * math.cos(2 * math.pi * k / pieces), radius * math.sin(2 * math.pi * k / pieces)) for k in range(pieces)]


def _cut_ring(s, ring, flange, is_horizontal, colour):
    """Both sections of a ring whose axis lies in the plane."""
    for side in (-1, 1):
        def box(r1, r2, z1, z2, fill):
            corners = (z1, side * r1, z2, side * r2) if is_horizontal else (side * r1, z1, side * r2, z2)
            s.rectangle(*corners, fill)
        half = ring.width / 2
        box(ring.bore, ring.floor, -half, half, "#f1ead9")
        for z in (-half, half - flange):
            box(ring.floor, ring.rim, z, z + flange, "#f1ead9")
        for layer, count in enumerate(ring.layers):
            for k in range(count):
                z, r = (k - 0.5 * (count - 1)) * ring.pitch, side * ring.offset(layer)
                x, y = s.place(*((z, r) if is_horizontal else (r, z)))
                s.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{0.5 * ring.pitch * s.scale:.2f}" fill="{colour}"/>')


def _face(s, ring, colour):
    s.band(circle(ring.bore), circle(ring.floor), "#f1ead9")
    s.band(circle(ring.floor), circle(ring.floor + len(ring.layers) * ring.pitch), colour)
    s.band(circle(ring.floor + len(ring.layers) * ring.pitch), circle(ring.rim), "#f1ead9")


def _wound(s, coil, colour):
    inner, outer = coil.outline.points_at(1e-6, 3), coil.outline.points_at(len(coil.layers) * coil.pitch, 8)
    s.band(inner, outer, colour)


def coils():
    """Sections through the middles of both triads."""
    t = Triads()
    s1, s2, s3 = t.source
    flange = t.data["source"]["flange"]
    s = Plan(1180, 560, "Source and sensor coils, cut through the middle (mm)")
    s.look(190, 290, 3.6)
    s.text(190, 70, "source, plane x z", "t", "middle")
    _face(s, s2, COLOURS[1])
    _cut_ring(s, s1, flange, True, COLOURS[0])
    _cut_ring(s, s3, flange, False, COLOURS[2])
    s.dimension((0, 0), (-s1.width / 2, s1.rim), f"corner {s1.corner:.2f}", "start", (8, 10))
    s.dimension((0, 0), (s2.bore * math.cos(-0.9), s2.bore * math.sin(-0.9)), f"bore of S2 {s2.bore:.1f}", "start", (8, -4))
    s.look(590, 290, 3.6)
    s.text(590, 70, "source, plane x y", "t", "middle")
    _face(s, s3, COLOURS[2])
    _cut_ring(s, s1, flange, True, COLOURS[0])
    _cut_ring(s, s2, flange, False, COLOURS[1])
    s.dimension((0, 0), (s2.rim, s2.width / 2), f"corner {s2.corner:.2f}", "end", (-24, -14))
    s.dimension((0, 0), (s3.bore * math.cos(-0.9), s3.bore * math.sin(-0.9)), f"bore of S3 {s3.bore:.1f}", "start", (8, -4))
    s.text(-10, 510, "\n".join(f"{ring.name}, about {axis}: {ring.turns} turns, {' + '.join(str(n) for n in ring.layers)} in layers, mean radius "
                               f"{1e3 * ring.radius_m:.2f}" for ring, axis in zip(t.source, "xyz")))
    c1, c2, c3 = t.sensor
    half, a = c1.window / 2, t.data["sensor"]["side"] / 2
    s.look(960, 290, 9.0)
    s.text(960, 70, "sensor, plane x y", "t", "middle")
    s.rectangle(-a, -a, a, a, "#f1ead9")
    for side in (-1, 1):
        s.rectangle(-half, side * a, half, side * (a + len(c1.layers) * c1.pitch), COLOURS[0])
        s.rectangle(side * a, -half, side * (a + len(c2.layers) * c2.pitch), half, COLOURS[1])
    _wound(s, c3, COLOURS[2])
    s.label(0, a + 0.3, "C1", "t", "middle")
    s.label(a - 2.2, 0, "C2", "t", "middle")
    s.label(a + 1.5, a + 1.5, "C3", "t", "middle")
    s.dimension((-a, -4), (a, -4), f"cube {2 * a:.1f}")
    s.dimension((-half, 4), (half, 4), f"{c1.window:.1f}")
    s.text(820, 510, "\n".join(f"{coil.name}: {coil.turns} turns in {len(coil.layers)} layers of {coil.per_layer}, {1e4 * coil.area_m2:.0f} cm^2"
                               for coil in t.sensor))
    return s


def former_sheet():
    """Formers with dimensions, winding direction, start and finish."""
    t = Triads()
    flange, sensor = t.data["source"]["flange"], t.data["sensor"]
    s = Plan(1180, 620, "Formers (mm): three rings of the source, cube of the sensor")
    ring = t.source[0]
    s.look(160, 330, 3.6)
    s.band(circle(ring.bore), circle(ring.rim), "#f1ead9")
    for angle, words in ((0, "start"), (formers.FINISH_DEG, "finish")):
        c, n = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        across = [(r * c - w * n, r * n + w * c) for r, w in ((ring.floor, -0.8), (ring.rim + 0.3, -0.8), (ring.rim + 0.3, 0.8), (ring.floor, 0.8))]
        s.shape(across, "#ffffff")
        s.label(c * (ring.rim + 1.5), n * (ring.rim + 1.5) - 1, words)
    arrow = [(27 * math.cos(v), 27 * math.sin(v)) for v in (0.3 + 0.1 * k for k in range(14))]
    s.parts.append('<polyline fill="none" stroke="#24384f" stroke-width="1.5" points="' + " ".join("{:.1f},{:.1f}".format(*s.place(*p)) for p in arrow) + '"/>')
    (x, y), (u, v) = arrow[-1], (math.cos(1.6), math.sin(1.6))
    s.shape([(x - 3 * v, y + 3 * u), (x + 1.5 * u, y + 1.5 * v), (x - 1.5 * u, y - 1.5 * v)], "#24384f")
    s.label(0, 8, "wind", "t", "middle")
    s.dimension((0, 0), (-ring.bore, 0), "bore")
    s.dimension((0, -6), (ring.rim, -6), "rim")
    s.text(160, 90, f"a ring from its start flange; notches {formers.NOTCH} wide,\nfrom the rim to the floor, {formers.FINISH_DEG} degrees apart", "v", "middle")
    s.look(450, 340, 9.0)
    w, deep = ring.width / 2, ring.rim - ring.bore
    s.shape([(-w, 0), (w, 0), (w, deep), (w - flange, deep), (w - flange, ring.floor - ring.bore), (flange - w, ring.floor - ring.bore),
             (flange - w, deep), (-w, deep)], "#f1ead9")
    s.text(450, 250, "profile", "t", "middle")
    s.dimension((-w, -2.2), (w, -2.2), "width", shift=(0, 16))
    s.dimension((flange - w, deep - 1.5), (w - flange, deep - 1.5), "window")
    s.dimension((w + 1.5, 0), (w + 1.5, deep), "rim - bore", "start", (8, 4))
    s.dimension((-w - 1.5, 0), (-w - 1.5, ring.floor - ring.bore), "wall", "end", (-8, 4))
    head = ("", "bore", "floor", "rim", "width", "window", "wall", "flange", "finish in")
    rows = [head] + [(r.name, *(f"{v:.1f}" for v in (r.bore, r.floor, r.rim, r.width, r.window, r.floor - r.bore, flange)),
                      "start flange" if formers.finish_side(r) < 0 else "other flange") for r in t.source]
    for i, row in enumerate(rows):
        for k, cell in enumerate(row):
            s.text(20 + 62 * k, 530 + 20 * i, cell, "t" if i == 0 or k == 0 else "v")
    side, groove, outside = (sensor[k] / 2 for k in ("side", "groove", "outside"))
    s.look(880, 300, 9.0)
    s.text(880, 90, "cube, seen along each axis", "t", "middle")
    s.rectangle(-side, -side, side, side, "#e3d9c2")
    for x in (-1, 1):
        for y in (-1, 1):
            s.rectangle(x * groove, y * groove, x * outside, y * outside, "#f1ead9")
    s.dimension((-outside, -outside - 2), (outside, -outside - 2), f"outside {2 * outside:.1f}", shift=(0, 16))
    s.dimension((-groove, outside - 2), (groove, outside - 2), f"groove {2 * groove:.1f}")
    s.dimension((outside + 2, -side), (outside + 2, side), f"bottom of the\ngrooves {2 * side:.1f}", "start", (8, 0))
    s.label(0, 0, "8 posts", "v", "middle")
    s.note(680, 530, "Wind C1 about x, then C2 about y over it, then C3 about z over both, right-handed\n"
                     "about the axis. Start and finish leave at one post, twisted.")
    return s


DRAWINGS = {"../coils.svg": coils, "formers.svg": former_sheet}
