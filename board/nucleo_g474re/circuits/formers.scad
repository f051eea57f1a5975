// Formers of the coils, generated from coils.toml by tests/circuits/run update. Lengths in mm.
//   openscad -D 'part="S1"' -o S1.stl formers.scad        part: S1, S2, S3, sensor, or all (the rings as assembled)
part = "all";
$fn = 240;

module ring(bore, base, rim, width, flange, finish_side) {
    difference() {
        rotate_extrude() polygon([[bore, -width / 2], [rim, -width / 2], [rim, -width / 2 + flange], [base, -width / 2 + flange],
            [base, width / 2 - flange], [rim, width / 2 - flange], [rim, width / 2], [bore, width / 2]]);
        notch(base, rim, -width / 2, flange, 0);                                                             // start
        notch(base, rim, finish_side > 0 ? width / 2 - flange : -width / 2, flange, 20);  // finish
    }
}
module notch(base, rim, z, flange, angle)
    rotate(angle) translate([base, -1.6 / 2, z - 0.01]) cube([rim - base + 1, 1.6, flange + 0.02]);

module S1() { ring(31.700, 33.200, 37.200, 15.200, 1.500, 1); }
module S2() { ring(38.300, 39.800, 42.600, 16.400, 1.500, -1); }
module S3() { ring(43.700, 45.200, 48.000, 14.000, 1.500, -1); }
// posts: the corners of a cube of side `outside`; the three grooves between them have the width `groove`
module sensor(side = 20.0, groove = 11.0, outside = 26.0) {
    cube(side, center = true);
    for (x = [-1, 1], y = [-1, 1], z = [-1, 1])
        translate([x, y, z] * (groove + outside) / 4) cube((outside - groove) / 2, center = true);
}

if (part == "S1") S1();
else if (part == "S2") S2();
else if (part == "S3") S3();
else if (part == "sensor") sensor();
else {
    rotate([0, 90, 0]) S1();
    rotate([90, 0, 0]) S2();
    S3();
}
