"""A schematic sheet of parts of the netlist. Symbols show designator, value and pad numbers; wires and names of nets are checked against
the netlist: what a sheet connects must be one net, and each net must be connected, by wires or by its name."""
import collections

from sheet import Sheet

GROUNDS = ("GND", "AGND", "PGND")
NEGATIVE = ("V-", "A5-")
POSITIVE = ("V+", "A5+", "3V3", "5V", "AVDD", "VDIG", "VFILT", "VREF")
OPEN = "-"
STUB = 22  # length of a pin of a box
SPACING = 24  # of the pins of a box
OUTWARD = {"l": (-1, 0), "r": (1, 0), "u": (0, -1), "d": (0, 1)}


class Schematic(Sheet):
    """parts: netlist.Part of every part of the board; a sheet places some of them."""

    def __init__(self, width, height, title, parts):
        super().__init__(width, height, title)
        self.board = {part.designator: part for part in parts}
        self.pins = {}  # (designator, number): (x, y)
        self.ways = {}  # (designator, number): direction away from the symbol
        self.links = []  # wires, lists of points
        self.names = []  # (net, (x, y))

    def net_of(self, designator, number):
        return self.board[designator].pads[number]

    def _pin(self, designator, numbers, place, way, shown=True):
        """numbers: pads of this pin, with blanks between."""
        for number in numbers.split():
            if (designator, number) in self.pins:
                raise ValueError(f"{self.title}: {designator}.{number} is there twice")
            if number not in self.board[designator].pads:
                raise ValueError(f"{self.title}: {designator} has no pad {number}")
            self.pins[designator, number] = place
            self.ways[designator, number] = way
        if shown:
            (x, y), words = place, numbers.replace(" ", ",")
            if way in "lr":
                self.text(x + (STUB - 4 if way == "l" else 4 - STUB), y - 4, words, "s", "end" if way == "l" else "start")
            else:
                self.text(x + 4, y + (12 if way == "u" else -5), words, "s")

    def link(self, *points):
        """A wire. A point may be 'R101.1': the place of a pin."""
        places = [self.at(point) if isinstance(point, str) else point for point in points]
        self.links.append(places)
        self.wire(*places)

    def at(self, pin):
        return self.pins[tuple(pin.split("."))]

    def name(self, net, x, y, way):
        """Name of the net at a place: a ground or supply symbol, or a flag that points away from the wire."""
        self.names.append((net, (x, y)))
        dx, dy = OUTWARD[way]
        if way == "d" and net in GROUNDS:
            self.ground(x, y)
            self.text(x, y + 30, net, "f", "middle")
        elif way == "d" and net in NEGATIVE or way == "u" and net in POSITIVE:
            self.supply(x, y, net, down=way == "d")
        elif dx:
            self.wire((x, y), (x + 16 * dx, y))
            self.text(x + 19 * dx, y + 4, net, "f", "end" if dx < 0 else "start")
        else:
            self.wire((x, y), (x, y + 10 * dy))
            self.text(x, y + (22 if dy > 0 else -14), net, "f", "middle")

    def title_of(self, designator):
        return designator + "\n" + self.board[designator].value

    def two(self, designator, first, second, side="right"):
        """A resistor, capacitor or diode between two places of a line. first: pad 1, of a diode the cathode; of a BAT54 pad 3."""
        numbers = ("3", "1") if self.board[designator].value == "BAT54" else ("1", "2")
        words = self.title_of(designator)
        if designator[0] == "R":
            self.resistor(first, second, words, side)
        elif designator[0] == "C":
            self.capacitor(first, second, words, side)
        else:
            self.diode(second, first, words, side, schottky=self.board[designator].value in ("SS34", "BAT54"))
        way = {(-1, 0): "l", (1, 0): "r", (0, -1): "u", (0, 1): "d"}[tuple((a > b) - (a < b) for a, b in zip(first, second))]
        opposite = {"l": "r", "r": "l", "u": "d", "d": "u"}[way]
        self._pin(designator, numbers[0], first, way, False)
        self._pin(designator, numbers[1], second, opposite, False)
        for number in self.board[designator].pads.keys() - set(numbers):  # open pads of a diode in a package of three
            self._pin(designator, number, (first[0] + 20, (first[1] + second[1]) // 2), "u")

    def ic(self, designator, x, y, width, height, pins, title=None):
        """A box. pins: 'SIDE OFFSET NUMBERS NAME' with commas between the numbers; sides l, r, u, d."""
        self.parts.append(f'<rect class="b" x="{x}" y="{y}" width="{width}" height="{height}" rx="3"/>')
        words = title or self.title_of(designator)
        self.text(x + width / 2, y + height / 2 + 4 - 7.5 * words.count("\n"), words, "t", "middle")
        for pin in pins:
            side, offset, numbers, *label = pin.split()
            label, offset, numbers = " ".join(label), int(offset), numbers.replace(",", " ")
            if side in "lr":
                edge, end = (x, x - STUB) if side == "l" else (x + width, x + width + STUB)
                self.wire((edge, y + offset), (end, y + offset))
                self.text(edge + (5 if side == "l" else -5), y + offset + 4, label, "v", "start" if side == "l" else "end")
                self._pin(designator, numbers, (end, y + offset), side)
            else:
                edge, end = (y, y - STUB) if side == "u" else (y + height, y + height + STUB)
                self.wire((x + offset, edge), (x + offset, end))
                self.text(x + offset, edge + (15 if side == "u" else -6), label, "v", "middle")
                self._pin(designator, numbers, (x + offset, end), side)

    def amplifier(self, designator, x, y, minus, plus, out, plus_above=False):
        """One op-amp of a package: inputs at (x, y -+ 20), output at (x + 80, y)."""
        self.opamp(x, y, designator, plus_above)
        upper, lower = (plus, minus) if plus_above else (minus, plus)
        for number, place, way in ((upper, (x, y - 20), "l"), (lower, (x, y + 20), "l"), (out, (x + 80, y), "r")):
            self._pin(designator, number, place, way, False)
            self.text(place[0] + (-4 if way == "l" else 2), place[1] - 4, number, "s", "end" if way == "l" else "start")

    def power(self, designator, x, y, plus, minus):
        """Supply pins of an op-amp at (x, y)."""
        for number, dy, way in ((plus, -1, "u"), (minus, 1, "d")):
            self.wire((x + 35, y + 22 * dy), (x + 35, y + 40 * dy))
            self._pin(designator, number, (x + 35, y + 40 * dy), way)

    def and_gate(self, designator, x, y, inputs, out):
        """Inputs at (x - 22, y - 22, y, y + 22), output at (x + 94, y)."""
        self._path(f"M{x} {y - 32} h40 a32 32 0 0 1 0 64 h-40 z", "p")
        self.text(x + 12, y + 4, designator, "t")
        for number, dy in zip(inputs, (-22, 0, 22)):
            self.wire((x, y + dy), (x - STUB, y + dy))
            self._pin(designator, number, (x - STUB, y + dy), "l")
        self.wire((x + 72, y), (x + 72 + STUB, y))
        self._pin(designator, out, (x + 72 + STUB, y), "r")

    def pair(self, designator, x, y):
        """BAV99: common 3 at (x, y), cathode 2 above, anode 1 below."""
        self.diode((x, y), (x, y - 60))
        self.diode((x, y + 60), (x, y))
        self.text(x + 14, y + 34, self.title_of(designator))
        for number, dy, way in (("2", -60, "u"), ("3", 0, "l"), ("1", 60, "d")):
            self._pin(designator, number, (x, y + dy), way, False)
            self.text(x + 4, y + dy + (12 if dy < 0 else -4), number, "s")

    def four_terminal(self, designator, x, y):
        """Sense resistor: current through 1 at (x, y) and 4 at (x, y + 100), sense wires 2 and 3 at (x - 50, y + 20 and y + 80)."""
        self.resistor((x, y), (x, y + 100), self.title_of(designator) + "\nfour-terminal")
        self.wire((x, y + 20), (x - 50, y + 20))
        self.wire((x, y + 80), (x - 50, y + 80))
        for number, place, way in (("1", (x, y), "u"), ("2", (x - 50, y + 20), "l"), ("3", (x - 50, y + 80), "l"), ("4", (x, y + 100), "d")):
            self._pin(designator, number, place, way)

    def transistor(self, designator, x, y):
        """SOT-23: base 1 at (x, y), emitter 2 and collector 3 at (x + 30, y -+ 30); a PNP has its emitter above."""
        is_pnp = self.board[designator].value == "MMBT3906"
        (self.pnp if is_pnp else self.npn)(x, y, designator)
        self.text(x + 38, y + 19, self.board[designator].value)
        emitter, collector = (x + 30, y - 30), (x + 30, y + 30)
        if not is_pnp:
            emitter, collector = collector, emitter
        for number, place, way in (("1", (x, y), "l"), ("2", emitter, "u" if is_pnp else "d"), ("3", collector, "d" if is_pnp else "u")):
            self._pin(designator, number, place, way, False)
            self.text(place[0] + (-2 if way == "l" else 5), place[1] - 4 if way != "u" else place[1] + 10, number, "s", "end" if way == "l" else "start")

    def test_point(self, designator, x, y):
        """Pin at (x, y), the circle above it."""
        self.wire((x, y), (x, y - 12))
        self.parts.append(f'<circle class="p" cx="{x}" cy="{y - 17}" r="5"/>')
        self.text(x, y - 28, f"{designator} {self.board[designator].value}", "v", "middle")
        self._pin(designator, "1", (x, y), "d", False)

    def finish(self):
        """Draws the names of the other pins and the dots. Once."""
        self._name_the_rest()
        self.dot(*self.junctions())
        return self

    # What is connected

    def _segments(self):
        for points in self.links:
            yield from zip(points, points[1:])

    def junctions(self):
        """Places at which three or more ends meet."""
        ends = collections.Counter(place for points in self.links for place in (points[0], points[-1]))
        ends.update(set(self.pins.values()))
        found = []
        for place in ends:
            through = sum(_is_inside(place, segment) for segment in self._segments())
            corners = sum(place in points[1:-1] for points in self.links)
            if ends[place] + 2 * (through + corners) >= 3:
                found.append(place)
        return found

    def groups(self):
        """Connected pins and names: lists of ('pin', key) and ('name', net)."""
        leader = {}

        def root(place):
            while leader.setdefault(place, place) != place:
                place = leader[place]
            return place

        for points in self.links:
            for place in points[1:]:
                leader[root(place)] = root(points[0])
        places = {*self.pins.values(), *(place for _, place in self.names), *(end for points in self.links for end in (points[0], points[-1]))}
        for place in places:
            for segment in self._segments():
                if _is_inside(place, segment):
                    leader[root(place)] = root(segment[0])
        found = collections.defaultdict(list)
        for key, place in self.pins.items():
            found[root(place)].append(("pin", key))
        for net, place in self.names:
            found[root(place)].append(("name", net))
        return list(found.values())

    def _name_the_rest(self):
        """Names at the pins that nothing connects; a cross at an open pin."""
        for group in self.groups():
            pins = [key for kind, key in group if kind == "pin"]
            if len({designator for designator, _ in pins}) > 1 or len({self.pins[key] for key in pins}) > 1 or len(pins) < len(group):
                continue
            x, y = self.pins[pins[0]]
            if self.net_of(*pins[0]) == OPEN:
                self.wire((x - 4, y - 4), (x + 4, y + 4))
                self.wire((x - 4, y + 4), (x + 4, y - 4))
            else:
                self.name(self.net_of(*pins[0]), x, y, self.ways[pins[0]])


def _is_inside(place, segment):
    """Whether a place lies on a horizontal or vertical segment, without its ends."""
    (x, y), ((x1, y1), (x2, y2)) = place, segment
    if x1 == x2:
        return x == x1 and min(y1, y2) < y < max(y1, y2)
    return y == y1 and min(x1, x2) < x < max(x1, x2)


def errors(sheets, parts):
    """sheets: by file name, drawn. Every pad is on one sheet once; what a sheet connects is one net; a net in several groups has its name at
    each."""
    pads = {(part.designator, number): net for part in parts for number, net in part.pads.items()}
    places = collections.Counter(key for sheet in sheets.values() for key in sheet.pins)
    found = [f"{designator}.{number} is on no sheet" for designator, number in pads if not places[designator, number]]
    found += [f"{designator}.{number} is on {count} sheets" for (designator, number), count in places.items() if count > 1]
    groups = collections.defaultdict(list)
    for file, sheet in sheets.items():
        for group in sheet.groups():
            nets = {pads[key] if kind == "pin" else key for kind, key in group}
            if len(nets) != 1 or OPEN in nets and len({sheet.pins.get(key) for _, key in group}) > 1:
                found.append(f"{file}: connects {', '.join(sorted(nets))}")
            if any(kind == "pin" for kind, _ in group):
                groups[min(nets)].append((file, group))
            else:
                found.append(f"{file}: {min(nets)} names no pin")
    for net, parts_of in groups.items():
        for file, group in parts_of:
            if net != OPEN and len(parts_of) > 1 and not any(kind == "name" for kind, _ in group):
                found.append(f"{file}: {net} at {'.'.join(group[0][1])} is not connected with the rest of its net")
    return found
