"""Geometry of the coils, from board/nucleo_g474re/circuits/coils.toml: layers, areas, wire, and whether the windings fit. Lengths in mm."""
import functools
import math
import os
import tomllib

from spice import CIRCUITS

PATH = os.path.join(CIRCUITS, "coils.toml")
COPPER_OHM_MM = 1.724e-5     # resistivity at 20 degrees, ohm mm (IEC 60028)
LEADS = 300.0                # start and finish of a winding together
SOURCE, SENSOR = ("S1", "S2", "S3"), ("C1", "C2", "C3")
COUNTS = ("strands", "per_layer", "turns")  # whole numbers
MAY_BE_ZERO = ("wall", "flange", "rim", "clearance", "tilt_deg", "radius_tol")
WIRE_KEYS = ("strands", "copper", "lay", "outer_min", "outer_max")
TRIAD_KEYS = {"source": ("wall", "flange", "rim", "clearance", "tilt_deg", "radius_tol"), "sensor": ("side", "groove", "outside", "clearance", "radius_tol")}
COIL_KEYS = {"source": ("bore", "window", "per_layer", "turns"), "sensor": ("window", "per_layer", "turns")}


def _put(tree, path, value):
    *parents, leaf = path
    for name in parents:
        tree = tree[name]
    if leaf not in tree:
        raise KeyError(f"coils.toml has no {'.'.join(path)}")
    tree[leaf] = value


def _need(place, table, keys):
    for key in keys:
        value = table.get(key) if isinstance(table, dict) else None
        kind = "a positive whole number" if key in COUNTS else "a number of 0 or more" if key in MAY_BE_ZERO else "a positive number"
        is_number = isinstance(value, int if key in COUNTS else (int, float)) and not isinstance(value, bool)
        if not is_number or not 0 <= value < math.inf or (value == 0 and key not in MAY_BE_ZERO):
            raise ValueError(f"coils.toml: [{place}] needs {kind} '{key}'")


def read(**overrides):
    """Content of coils.toml. overrides: 'S1.turns' (of a coil), 'litz.outer_max' (of a wire), 'source.wall' (of a triad)."""
    with open(PATH, "rb") as file:
        try:
            tree = tomllib.load(file)
        except tomllib.TOMLDecodeError as error:
            raise ValueError(f"coils.toml: {error}") from error
    for name, value in overrides.items():
        owner, key = name.split(".")
        path = {**{n: ("source", "coils") for n in SOURCE}, **{n: ("sensor", "coils") for n in SENSOR},
                **{n: ("wire",) for n in tree["wire"]}}.get(owner, ())
        _put(tree, (*path, owner, key), value)
    wires = tree.get("wire", {})
    for name, wire in wires.items():
        _need(f"wire.{name}", wire, WIRE_KEYS)
        if not wire["copper"] < wire["outer_min"] <= wire["outer_max"]:
            raise ValueError(f"coils.toml: [wire.{name}] needs copper < outer_min <= outer_max")
    for triad, names in (("source", SOURCE), ("sensor", SENSOR)):
        table = tree.get(triad, {})
        _need(triad, table, TRIAD_KEYS[triad])
        for name in names:
            _need(f"{triad}.coils.{name}", table.get("coils", {}).get(name), COIL_KEYS[triad])
        if table.get("wire") not in wires:
            raise ValueError(f"coils.toml: [{triad}] names the wire '{table.get('wire')}', but there is no [wire.{table.get('wire')}]; "
                             f"use one of: {', '.join(wires)}")
    return tree


class Outline:
    """Convex polygon, offset outwards by the distance t: straight sides and arcs about its corners."""

    def __init__(self, corners):
        self.corners = corners
        n = len(corners)
        self.perimeter = sum(math.dist(corners[k], corners[(k + 1) % n]) for k in range(n))
        self.area = 0.5 * sum(corners[k][0] * corners[(k + 1) % n][1] - corners[(k + 1) % n][0] * corners[k][1] for k in range(n))

    def area_at(self, t):
        return self.area + self.perimeter * t + math.pi * t * t  # Steiner's formula

    def length_at(self, t):
        return self.perimeter + 2 * math.pi * t

    def points_at(self, t, per_corner=4):
        """Corners of a polygon around the offset outline, counterclockwise, with the same area within 1e-3."""
        points, n = [], len(self.corners)
        for k, (x, y) in enumerate(self.corners):
            before, after = self.corners[k - 1], self.corners[(k + 1) % n]
            first = math.atan2(-(x - before[0]), y - before[1])
            last = math.atan2(-(after[0] - x), after[1] - y)
            turn = (last - first) % (2 * math.pi)
            for i in range(per_corner):
                angle = first + turn * (i + 0.5) / per_corner
                points.append((x + t * math.cos(angle), y + t * math.sin(angle)))
        return points


class Circle(Outline):
    """A point, offset by the radius."""

    def __init__(self):
        self.corners, self.perimeter, self.area = [(0.0, 0.0)], 0.0, 0.0


def hull(points):
    """Convex hull, counterclockwise (monotone chain, Andrew 1979)."""
    points = sorted(set(points))

    def chain(ordered):
        kept = []
        for p in ordered:
            while len(kept) > 1 and ((kept[-1][0] - kept[-2][0]) * (p[1] - kept[-2][1])
                                     - (kept[-1][1] - kept[-2][1]) * (p[0] - kept[-2][0])) <= 0:
                kept.pop()
            kept.append(p)
        return kept[:-1]

    return chain(points) + chain(points[::-1])


class Coil:
    """A winding in layers on an outline. base: distance of the bottom of the lowest layer from the outline."""

    def __init__(self, name, data, wire, outline, base):
        self.name, self.wire, self.outline, self.base = name, wire, outline, base
        self.turns, self.per_layer, self.window = data["turns"], data["per_layer"], data["window"]
        full, rest = divmod(self.turns, self.per_layer)
        self.layers = [self.per_layer] * full + ([rest] if rest else [])
        self.pitch = 0.5 * (wire["outer_min"] + wire["outer_max"])
        self.depth_most = len(self.layers) * wire["outer_max"]

    def offset(self, layer):
        return self.base + (layer + 0.5) * self.pitch

    @property
    def area_m2(self):
        """Turns times area."""
        return 1e-6 * sum(n * self.outline.area_at(self.offset(k)) for k, n in enumerate(self.layers))

    @property
    def radius_m(self):
        """Radius of a circle with the mean area of the turns."""
        return math.sqrt(self.area_m2 / self.turns / math.pi)

    @property
    def wire_mm(self):
        return sum(n * self.outline.length_at(self.offset(k)) for k, n in enumerate(self.layers)) + LEADS

    @property
    def ohm(self):
        """Resistance at 20 degrees for direct current."""
        return COPPER_OHM_MM * self.wire["lay"] * self.wire_mm / (self.wire["strands"] * math.pi / 4 * self.wire["copper"]**2)

    @property
    def spare_in_window(self):
        """Width left in the window beside the thickest wire; negative: does not fit."""
        return self.window - self.per_layer * self.wire["outer_max"]


class Ring(Coil):
    """A coil on a ring of its own, and the ring."""

    def __init__(self, name, data, wire, source):
        self.bore = data["bore"]
        self.floor = self.bore + source["wall"]
        super().__init__(name, data, wire, Circle(), self.floor)
        self.rim = self.floor + self.depth_most + source["rim"]
        self.width = self.window + 2 * source["flange"]
        self.corner = math.hypot(self.rim, 0.5 * self.width)  # radius of the sphere in which the ring turns


@functools.cache
def _cube_outlines(side, windows, rises):
    """Outlines of the three windings of a cube. A winding that crosses over another one of height rises[k] and width windows[k] on two
    opposite sides leads from the corners of the cube over the edges of the lower winding."""
    a, (b, c) = side / 2, (window / 2 for window in windows)
    corners = [(x, y) for x in (-a, a) for y in (-a, a)]
    over_y = [(x, y * (a + rises[0])) for x in (-b, b) for y in (-1, 1)]
    over_x = [(x * (a + rises[1]), y) for x in (-1, 1) for y in (-c, c)]
    return Outline(hull(corners)), Outline(hull(corners + over_y)), Outline(hull(corners + over_y + over_x))


class Triads:
    """Both triads. overrides: see read()."""

    def __init__(self, **overrides):
        self.data = read(**overrides)
        source, sensor, wires = self.data["source"], self.data["sensor"], self.data["wire"]
        self.source = [Ring(name, source["coils"][name], wires[source["wire"]], source) for name in SOURCE]
        wire, self.sensor = wires[sensor["wire"]], []
        for k, name in enumerate(SENSOR):
            rises = tuple(len(coil.layers) * coil.pitch for coil in self.sensor) + (0.0, 0.0)
            outline = _cube_outlines(sensor["side"], tuple(sensor["coils"][lower]["window"] for lower in SENSOR[:2]), rises[:2])[k]
            self.sensor.append(Coil(name, sensor["coils"][name], wire, outline, 0.0))
        self.coils = self.source + self.sensor

    def ring_gaps(self):
        """Distance from the corners of a ring to the bore of the next one, less the clearance; negative: does not fit."""
        return [outer.bore - inner.corner - self.data["source"]["clearance"] for inner, outer in zip(self.source, self.source[1:])]

    def groove_spare(self):
        """Depth of the grooves above the highest turn of the thickest wire, less the clearance. Two windings cross on each face."""
        sensor = self.data["sensor"]
        stack = sum(sorted(coil.depth_most for coil in self.sensor)[1:])
        return 0.5 * (sensor["outside"] - sensor["side"]) - stack - sensor["clearance"]

    def window_spare(self):
        spare = [coil.spare_in_window for coil in self.coils]
        return min(spare + [self.data["sensor"]["groove"] - coil.window for coil in self.sensor])

    def misfits(self):
        """What does not fit, a line each."""
        found = [f"coil {inner.name} does not fit into {outer.name}: {-gap:.2f} mm too large; fewer turns, or a larger bore of {outer.name}"
                 for inner, outer, gap in zip(self.source, self.source[1:], self.ring_gaps()) if gap < 0]
        found += [f"coil {coil.name}: a layer of {coil.per_layer} turns is {-coil.spare_in_window:.2f} mm wider than the window"
                  for coil in self.coils if coil.spare_in_window < 0]
        found += [f"coil {coil.name}: its window is wider than the groove" for coil in self.sensor if coil.window > self.data["sensor"]["groove"]]
        if self.groove_spare() < 0:
            found.append(f"the sensor's coils are {-self.groove_spare():.2f} mm higher than its grooves; fewer turns, or a larger outside")
        return found

    def wire_m(self, wire):
        """Length to buy, m: of all coils with this wire."""
        return 1e-3 * sum(coil.wire_mm for coil in self.coils if coil.wire is self.data["wire"][wire])
