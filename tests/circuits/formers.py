"""Formers of the coils: an OpenSCAD model of coils.toml, and what its meshes must be (bounding box, volume)."""
import math
import os
import struct
import subprocess
import tempfile

from spice import CIRCUITS
from winding import SOURCE, Triads

PATH = os.path.join(CIRCUITS, "formers.scad")
NOTCH = 1.6          # width of the notches for start and finish, mm
FINISH_DEG = 20      # from start to finish
SIDES = 240          # of a circle

MODEL = """// Formers of the coils, generated from coils.toml by tests/circuits/run update. Lengths in mm.
//   openscad -D 'part="S1"' -o S1.stl formers.scad        part: S1, S2, S3, sensor, or all (the rings as assembled)
part = "all";
$fn = {sides};

module ring(bore, base, rim, width, flange, finish_side) {{
    difference() {{
        rotate_extrude() polygon([[bore, -width / 2], [rim, -width / 2], [rim, -width / 2 + flange], [base, -width / 2 + flange],
            [base, width / 2 - flange], [rim, width / 2 - flange], [rim, width / 2], [bore, width / 2]]);
        notch(base, rim, -width / 2, flange, 0);                                                             // start
        notch(base, rim, finish_side > 0 ? width / 2 - flange : -width / 2, flange, {finish});  // finish
    }}
}}
module notch(base, rim, z, flange, angle)
    rotate(angle) translate([base, -{notch} / 2, z - 0.01]) cube([rim - base + 1, {notch}, flange + 0.02]);

module S1() {{ {S1} }}
module S2() {{ {S2} }}
module S3() {{ {S3} }}
// posts: the corners of a cube of side `outside`; the three grooves between them have the width `groove`
module sensor(side = {side}, groove = {groove}, outside = {outside}) {{
    cube(side, center = true);
    for (x = [-1, 1], y = [-1, 1], z = [-1, 1])
        translate([x, y, z] * (groove + outside) / 4) cube((outside - groove) / 2, center = true);
}}

if (part == "S1") S1();
else if (part == "S2") S2();
else if (part == "S3") S3();
else if (part == "sensor") sensor();
else {{
    rotate([0, 90, 0]) S1();
    rotate([90, 0, 0]) S2();
    S3();
}}
"""


def finish_side(ring):
    """Flange of the finish: -1 that of the start (even number of layers), 1 the other one."""
    return -1 if len(ring.layers) % 2 == 0 else 1


def model(triads):
    flange, sensor = triads.data["source"]["flange"], triads.data["sensor"]
    rings = {ring.name: f"ring({ring.bore:.3f}, {ring.floor:.3f}, {ring.rim:.3f}, {ring.width:.3f}, {flange:.3f}, {finish_side(ring)});"
             for ring in triads.source}
    return MODEL.format(sides=SIDES, finish=FINISH_DEG, notch=NOTCH, **rings, **{k: sensor[k] for k in ("side", "groove", "outside")})


def expected(triads):
    """Sizes (x, y, z) in mm and volume in mm^3 by part."""
    flange, sensor = triads.data["source"]["flange"], triads.data["sensor"]
    polygon = SIDES / 2 * math.sin(2 * math.pi / SIDES)  # area of the circle's polygon, radius 1
    parts = {}
    for ring in triads.source:
        volume = polygon * ((ring.floor**2 - ring.bore**2) * ring.width + (ring.rim**2 - ring.floor**2) * 2 * flange)
        parts[ring.name] = ((2 * ring.rim, 2 * ring.rim, ring.width), volume - 2 * NOTCH * (ring.rim - ring.floor) * flange)
    side, groove, outside = (sensor[k] for k in ("side", "groove", "outside"))
    volume = side**3 + ((outside - groove)**3 - (side - groove)**3)  # eight posts less the part inside the cube
    parts["sensor"] = ((outside,) * 3, volume)
    return parts


def mesh(path):
    """Sizes and volume of a binary STL file."""
    with open(path, "rb") as file:
        data = file.read()
    count, = struct.unpack_from("<I", data, 80)
    low, high, volume = [math.inf] * 3, [-math.inf] * 3, 0.0
    for k in range(count):
        corners = [struct.unpack_from("<3f", data, 84 + 50 * k + 12 * (i + 1)) for i in range(3)]
        a, b, c = corners
        volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6
        low, high = ([pick(v, *(corner[i] for corner in corners)) for i, v in enumerate(box)] for pick, box in ((min, low), (max, high)))
    return tuple(h - lo for lo, h in zip(low, high)), volume


def render(folder):
    """Writes the STL files of all parts into a folder; returns their paths by part."""
    paths = {}
    for part in (*SOURCE, "sensor"):
        paths[part] = os.path.join(folder, f"{part}.stl")
        subprocess.run(["openscad", "-q", "--export-format", "binstl", "-D", f'part="{part}"', "-o", paths[part], PATH], check=True, timeout=600)
    return paths


def differences():
    """Errors of the meshes: a size that differs by more than 0.1 mm, a volume by more than 0.5 %."""
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        paths = render(folder)
        for part, (sizes, volume) in expected(Triads()).items():
            found = mesh(paths[part])
            text = f"{part}: {' x '.join(f'{s:.2f}' for s in found[0])} mm, {found[1] / 1e3:.3f} cm^3"
            is_wrong = max(abs(s - t) for s, t in zip(found[0], sizes)) > 0.1 or abs(found[1] / volume - 1) > 5e-3
            print(f"{'FAIL' if is_wrong else 'ok  '} {text}; geometry: {' x '.join(f'{s:.2f}' for s in sizes)} mm, {volume / 1e3:.3f} cm^3")
            wrong += [part] if is_wrong else []
    return wrong
