"""Layout of the schematic sheets: where each part of netlist.csv stands, and which nets are drawn as wires."""
from schematic import SPACING, Schematic, errors


def power_stage(parts, k):
    s = Schematic(1460, 1040, f"Power stage S{k}", parts)

    def n(text):
        return text.replace("#", str(k))

    s.two(n("C#01"), (60, 240), (150, 240))
    s.two(n("R#01"), (150, 240), (260, 240))
    s.ic(n("U#01"), 500, 190, 170, 280, ["l 50 5 IN+", "l 100 4 E/S", "l 150 6 IN-", "r 50 15,16 OUT", "r 95 3 T_FLAG", "r 190 8 I_FLAG",
                                          "r 230 12 T_SENSE", "u 45 2,17,18,19 V+", "u 130 7 V_DIG", "d 40 9 I_SET", "d 110 1,10,11,13,14,20 V-"])
    s.link((260, 240), n("U#01.5"))
    s.two(n("R#02"), (300, 240), (300, 330), "left")
    s.two(n("C#02"), (360, 240), (360, 330))
    s.two(n("R#03"), (540, 492), (540, 570), "left")
    s.two(n("R#05"), (640, 640), (520, 640))
    s.two(n("R#04"), (640, 710), (520, 710))
    s.link(n("U#01.6"), (440, 340), (440, 640), (520, 640))
    s.link((440, 640), (440, 710), (520, 710))
    s.link((640, 640), (790, 640), (790, 240))
    s.link(n("U#01.15"), (1020, 240))
    s.test_point(n("TP#03"), 740, 240)
    s.two(n("R#06"), (850, 240), (850, 330))
    s.two(n("C#03"), (850, 330), (850, 410))
    s.two(n("D#01"), (950, 160), (950, 240))
    s.two(n("D#02"), (950, 240), (950, 320))
    s.name(n("OUT#"), 1020, 240, "r")
    s.note(1100, 244, f"to the source coil S{k}, J1")
    s.four_terminal(n("R#07"), 1180, 400)
    s.link((1180, 360), n("R#07.1"))
    s.name(n("COIL#"), 1180, 360, "u")
    s.note(1220, 350, "from the coil, J1")
    s.link(n("R#07.2"), (1000, 420), (1000, 710), (640, 710))
    s.test_point(n("TP#04"), 1060, 420)
    s.name(n("SENSE#"), 1000, 560, "r")
    # enable
    s.two(n("R#10"), (60, 820), (60, 900))
    s.two(n("R#09"), (170, 820), (270, 820))
    s.transistor(n("Q#01"), 270, 880)
    s.link((270, 820), (300, 820), (300, 850))
    s.two(n("R#08"), (300, 930), (300, 1000), "left")
    s.link((300, 910), (300, 930))
    s.link((300, 920), (440, 920))
    s.test_point(n("TP#05"), 410, 920)
    s.name(n("ES#"), 440, 920, "r")
    # thermal flag
    s.two(n("R#11"), (620, 880), (720, 880))
    s.link((550, 880), (620, 880))
    s.test_point(n("TP#01"), 570, 880)
    s.name(n("TFLAG#"), 550, 880, "l")
    s.transistor(n("Q#02"), 790, 880)
    s.link((720, 880), (790, 880))
    s.two(n("R#12"), (750, 880), (750, 960), "left")
    s.test_point(n("TP#02"), 940, 850)
    s.test_point(n("TP#06"), 940, 970)
    for x, part in zip(range(1020, 1460, 90), ("C#04", "C#06", "C#05", "C#07", "C#08")):
        upper, lower = ((x, 900), (x, 820)) if part == "C#07" else ((x, 820), (x, 900))
        s.two(n(part), upper, lower)
    s.note(20, 70, f"PA{3 + k} (DAC) gives 1.65 V and the carrier. The current of the coil is the carrier's voltage after the divider over the sense resistor.\n"
                  "Thermal pad: on the heat sink, insulated: it is at V-. The three sense resistors end at one star point.")
    s.note(20, 770, f"Enable: PC{5 + k} and heartbeat, from the gates. High: on.")
    s.note(520, 770, "Thermal flag: a hot stage pulls HOT down,\nall stages go off.")
    s.note(1005, 770, "At the pins of the OPA564:")
    return s


def reference(parts):
    s = Schematic(1180, 540, "Reference amplifier", parts)
    for k, y in ((1, 120), (2, 180), (3, 240)):
        s.two(f"R40{k}", (100, y), (200, y))
    s.link((200, 120), (240, 120), (240, 240), (200, 240))
    s.link((200, 180), (240, 180))
    s.link((240, 180), (360, 180))
    s.two("C401", (290, 180), (290, 270))
    s.two("R404", (360, 180), (480, 180))
    s.link((480, 180), (600, 180))
    s.amplifier("U401", 600, 200, "4", "3", "1")
    s.power("U401", 600, 200, "5", "2")
    s.two("R405", (440, 70), (560, 70))
    s.link((330, 180), (330, 70), (440, 70))
    s.link((560, 70), (740, 70), (740, 200))
    s.two("C402", (560, 125), (610, 125))
    s.link((530, 180), (530, 125), (560, 125))
    s.link((610, 125), (740, 125))
    s.link((680, 200), (780, 200))
    s.two("R406", (780, 200), (880, 200))
    s.link((880, 200), (1010, 200))
    s.two("C403", (920, 200), (920, 290))
    s.test_point("TP401", 975, 200)
    s.name("PA0", 1010, 200, "r")
    s.two("R407", (480, 310), (480, 390), "left")
    s.two("R408", (480, 390), (480, 470), "left")
    s.link((480, 390), (560, 390))
    s.two("C404", (560, 390), (560, 470))
    s.link((600, 220), (540, 220), (540, 390))
    s.two("R409", (780, 390), (880, 390))
    s.link((880, 390), (1020, 390))
    s.two("C405", (920, 390), (920, 470))
    s.two("C406", (1000, 390), (1000, 470))
    s.name("VREF", 1020, 390, "r")
    s.note(20, 510, "The same low-pass as in the sensor channels. Each SENSE and its ground: a pair of wires from the inner terminals of the resistor.")
    return s


def enable(parts):
    s = Schematic(1380, 740, "Enable, heartbeat, thermal flag, status LED", parts)
    s.name("PC9", 60, 120, "l")
    s.link((60, 120), (170, 120))
    s.two("R501", (100, 120), (100, 200))
    s.two("C501", (170, 120), (240, 120))
    s.link((240, 120), (340, 120))
    s.two("R502", (290, 120), (290, 200))
    s.two("R503", (340, 120), (430, 120))
    s.link((430, 120), (540, 120))
    s.two("D501", (450, 120), (450, 200), "left")
    s.ic("U502", 562, 90, 150, 150, ["l 30 2 B", "l 75 1 A", "l 120 3 CLR", "r 40 5 Q", "r 110 4 GND", "u 75 8 VCC", "d 45 6 C", "d 105 7 RC"],
         "U502\nSN74LVC1G123")
    s.ic("U503", 330, 265, 150, 60, ["r 30 2", "u 75 3", "d 75 1"], "U503\nTPS3839K33\n3.0 V")
    s.link("U503.2", (515, 295), (515, 210), (540, 210))
    s.link("U502.6", (607, 310))
    s.link("U502.7", (667, 310))
    s.two("C502", (607, 310), (667, 310), "below")
    s.two("R504", (770, 310), (667, 310))
    s.link("U502.5", (830, 130))
    s.test_point("TP501", 790, 130)
    s.name("BEAT", 830, 130, "r")
    s.two("C503", (920, 120), (920, 200))
    s.two("C504", (1000, 120), (1000, 200))
    s.two("R505", (1130, 120), (1220, 120))
    s.two("D502", (1220, 200), (1220, 120))
    for y, inputs, out in ((440, "1 2 13", "12"), (550, "3 4 5", "6"), (660, "9 10 11", "8")):
        s.and_gate("U501", 150, y, inputs.split(), out)
    s.ic("U501", 380, 520, 90, 60, ["u 45 14", "d 45 7"], "U501\n74HC11D")
    s.name("COOL", 620, 550, "l")
    s.link((620, 550), (840, 550))
    s.two("D503", (660, 550), (660, 630), "left")
    s.two("C505", (720, 550), (720, 630))
    s.two("R507", (770, 460), (770, 550))
    s.test_point("TP502", 690, 550)
    s.two("R506", (840, 550), (930, 550))
    s.two("R508", (1090, 460), (1090, 550))
    s.name("NTC", 1070, 550, "l")
    s.link((1070, 550), (1190, 550))
    s.two("C506", (1110, 550), (1110, 630), "left")
    s.ic("J501", 1212, 520, 150, 80, ["l 30 1", "l 60 2"], "J501\nthermistor on\nthe heat sink")
    s.note(130, 400, "A stage is on while its line is high, the heartbeat runs, and all stages are cool.")
    s.note(620, 690, "HOT: open, or pulled to V- by a hot stage. COOL: PC1.")
    return s


PREAMPLIFIERS = ((("U601", "2", "3", "1"), ("U603", "2", "3", "1")), (("U601", "6", "5", "7"), ("U603", "6", "5", "7")),
                 (("U602", "2", "3", "1"), ("U603", "9", "10", "8")))  # (designator, minus, plus, output) of both stages by channel


def _preamplifier(s, k, y):
    first, second = PREAMPLIFIERS[k - 1]

    def n(text):
        return text.replace("#", str(k))

    s.name(n("SC#"), 30, y, "l")
    s.link((30, y), (340, y))
    s.two(n("R6#1"), (80, y), (80, y + 90))
    s.pair(n("D6#1"), 200, y)
    s.amplifier(first[0], 340, y + 20, *first[1:], plus_above=True)
    s.link((340, y + 40), (310, y + 40), (310, y + 110), (360, y + 110))
    s.two(n("R6#3"), (450, y + 110), (360, y + 110))
    s.two(n("R6#2"), (310, y + 110), (310, y + 190), "left")
    s.link((450, y + 110), (470, y + 110), (470, y + 20))
    s.link((420, y + 20), (520, y + 20))
    s.two(n("R6#4"), (520, y + 20), (610, y + 20), "below")
    s.link((610, y + 20), (710, y + 20))
    s.two(n("C6#1"), (660, y + 20), (660, y + 110))
    s.two(n("R6#6"), (710, y + 20), (800, y + 20))
    s.link((800, y + 20), (890, y + 20))
    s.amplifier(second[0], 890, y + 40, *second[1:])
    s.two(n("R6#5"), (720, y - 80), (820, y - 80))
    s.link((640, y + 20), (640, y - 80), (720, y - 80))
    s.link((820, y - 80), (1010, y - 80), (1010, y + 40))
    s.two(n("C6#2"), (880, y - 25), (940, y - 25))
    s.link((840, y + 20), (840, y - 25), (880, y - 25))
    s.link((940, y - 25), (1010, y - 25))
    s.link((970, y + 40), (1040, y + 40))
    s.two(n("R6#7"), (1040, y + 40), (1130, y + 40))
    s.link((1130, y + 40), (1260, y + 40))
    s.two(n("C6#3"), (1170, y + 40), (1170, y + 130))
    s.test_point(n("TP6#1"), 1225, y + 40)
    s.name(n("ADC#"), 1260, y + 40, "r")
    s.two(n("C6#4"), (1370, y + 40), (1370, y + 130))


def preamplifiers(parts):
    s = Schematic(1460, 1530, "Preamplifiers of the sensor coils", parts)
    for k in (1, 2, 3):
        _preamplifier(s, k, 170 + 340 * (k - 1))
    s.note(20, 70, "Shields: joined to AGND at J2, open at the coil. Outputs rest at 1.65 V (11 x BIAS), and cannot leave 0 to 3.3 V.")
    y = 1180
    s.two("R691", (100, y), (100, y + 80), "left")
    s.two("R692", (100, y + 80), (100, y + 160), "left")
    s.link((100, y + 80), (230, y + 80))
    s.two("C691", (160, y + 80), (160, y + 160))
    s.name("BIAS", 230, y + 80, "r")
    s.two("R693", (360, y + 80), (450, y + 80))
    s.link((450, y + 80), (610, y + 80))
    s.two("C692", (490, y + 80), (490, y + 160))
    s.two("C693", (570, y + 80), (570, y + 160))
    s.name("VFILT", 610, y + 80, "r")
    for x, spare in ((760, ("U602", "6", "5", "7")), (960, ("U603", "13", "12", "14"))):
        s.amplifier(spare[0], x, y + 80, *spare[1:], plus_above=True)
        s.link((x, y + 100), (x - 20, y + 100), (x - 20, y + 150), (x + 100, y + 150), (x + 100, y + 80), (x + 80, y + 80))
    s.note(720, y + 20, "spare op-amps")
    for x, part, plus, minus in ((1110, "U601", 8, 4), (1230, "U602", 8, 4), (1350, "U603", 4, 11)):
        s.ic(part, x, y + 50, 90, 60, [f"u 45 {plus}", f"d 45 {minus}"], part + "\n" + s.board[part].value[:8])
    for x, part in zip(range(760, 1400, 100), ("C694", "C695", "C696", "C697")):
        upper, lower = ((x, y + 240), (x, y + 310)) if part in ("C694", "C696") else ((x, y + 310), (x, y + 240))
        s.two(part, upper, lower)
    return s


# Pins of the processor at the headers of the Nucleo, by net
PROCESSOR = {"DAC1": "PA4", "DAC2": "PA5", "DAC3": "PA6", "EN1": "PC6", "EN2": "PC7", "EN3": "PC8", "ADC1": "PB0", "ADC2": "PB12", "ADC3": "PB13",
             "VINM1": "PB2", "VINM2": "PA1", "VINM3": "PB10", "COOL": "PC1", "NTC": "PC0"}


def controller(parts):
    s = Schematic(1680, 980, "Controller: headers of the Nucleo, CAN, USB, coils", parts)
    for x, header in ((90, "CN7"), (400, "CN10")):
        pads = s.board[header].pads
        s.ic(header, x, 60, 150, 19 * SPACING + 24,
             [f"{'lr'[(number - 1) % 2]} {SPACING * ((number + 1) // 2)} {number} {PROCESSOR.get(pads[str(number)], '')}"
              for number in range(1, 39)], header)
    # CAN
    s.ic("U701", 800, 100, 150, 200, ["l 30 1 TXD", "l 70 4 RXD", "l 110 8 STB", "u 45 3 VCC", "u 110 5 VIO", "r 40 7 CANH", "r 160 6 CANL",
                                      "d 75 2 GND"], "U701\nTCAN1044AV")
    s.two("R701", (740, 50), (740, 130), "left")
    s.link((720, 130), (778, 130))
    s.name("PB6", 720, 130, "l")
    s.ic("L701", 1020, 120, 110, 160, ["l 20 1", "l 140 4", "r 20 2", "r 140 3"], "L701\nACT45B-\n510-2P\n51 uH")
    s.link("U701.7", "L701.1")
    s.link("U701.6", "L701.4")
    s.link("L701.2", (1520, 140))
    s.link("L701.3", (1520, 260))
    s.two("R702", (1190, 140), (1190, 200))
    s.two("R703", (1190, 200), (1190, 260))
    s.link((1190, 200), (1290, 200))
    s.two("C701", (1290, 200), (1350, 200))
    s.ic("D701", 1370, 310, 140, 50, ["u 40 2", "u 100 1", "d 70 3"])
    s.link("D701.2", (1410, 260))
    s.link("D701.1", (1470, 140))
    s.ic("J701", 1542, 120, 110, 160, ["l 20 1 H", "l 80 2", "l 140 3 L"], "J701\nCAN,\nM12")
    s.two("C702", (1040, 330), (1040, 400))
    s.two("C703", (1120, 330), (1120, 400))
    s.note(1190, 320, "R702 and R703 only at the\ntwo ends of a bus")
    # USB
    s.ic("U801", 800, 480, 150, 120, ["l 30 6 D-", "l 90 4 D+", "r 30 1", "r 90 3", "u 75 5 VBUS", "d 75 2 GND"])
    s.ic("J801", 1100, 460, 180, 190, ["l 50 A7,B7 D-", "l 110 A6,B6 D+", "d 90 A1,A12,B1,B12,S1 GND, shell", "r 50 A5 CC1", "r 110 B5 CC2",
                                       "r 140 A4,A9,B4,B9 VBUS", "r 170 A8,B8 SBU"], "J801\nUSB-C")
    s.link("U801.1", "J801.A7")
    s.link("U801.3", "J801.A6")
    s.link("J801.A5", (1330, 510))
    s.two("R801", (1330, 510), (1410, 510))
    s.link("J801.B5", (1330, 570))
    s.two("R802", (1330, 570), (1410, 570))
    # coils
    s.ic("J1", 90, 660, 190, 7 * SPACING + 24, [f"r {SPACING * n} {n} {name}" for n, name in enumerate(
        ("S1 start", "S1 finish", "S2 start", "S2 finish", "S3 start", "S3 finish", "shield"), 1)], "J1\nsource")
    s.ic("J2", 430, 660, 190, 7 * SPACING + 24, [f"r {SPACING * n} {n} {name}" for n, name in enumerate(
        ("C1 start", "C1 finish", "C2 start", "C2 finish", "C3 start", "C3 finish", "shield"), 1)], "J2\nsensor")
    s.note(90, 900, "Source and sensor: M12 A-coded, 8 pins, female; pins 1 to 6 as J1 and J2, shield on the shell.\n"
                    "VBUS of the USB connector stays open: the ST-LINK supplies the Nucleo.")
    return s


def _fuse(s, y, k):
    """Electronic fuse of one converter; k: A, B."""
    first = 901 if k == "A" else 904
    divider, lower, limit = (f"R{first + n}" for n in range(3))
    ramp, inlet = ("C901", "C902") if k == "A" else ("C903", "C904")
    fuse = "U901" if k == "A" else "U902"
    s.ic(fuse, 540, y - 40, 220, 225, ["l 40 1,2 IN", "l 70 3 UVLO", "l 110 5 OVP", "l 160 9 GND", "r 40 15,16 OUT", "r 90 11 ILIM", "r 135 12 dVdT",
                                       "r 195 8,17 RTN", "d 20 4 NC", "d 60 6 MODE", "d 105 7 SHDN", "d 147 10 IMON", "d 180 13 NC", "d 205 14 FLT"],
         f"{fuse}\nTPS26600")
    s.link((232, y), (518, y))
    s.link(f"{fuse}.3", (490, y + 30), (490, y))
    s.two(divider, (440, y), (440, y + 70), "left")
    s.link((440, y + 70), (518, y + 70))
    s.two(lower, (440, y + 70), (440, y + 140), "left")
    s.two(inlet, (320, y), (320, y + 80))
    s.link(f"{fuse}.11", (820, y + 50))
    s.two(limit, (820, y + 50), (900, y + 50))
    s.link(f"{fuse}.12", (830, y + 95))
    s.two(ramp, (830, y + 95), (890, y + 95), "below")
    s.two("D901" if k == "A" else "D902", (1010, y), (1010, y + 80))
    s.two("C905" if k == "A" else "C906", (1100, y), (1100, y + 80))
    s.link(f"{fuse}.15", (1210, y))
    s.name("V+" if k == "A" else "PGND", 1210, y, "r")


def _regulator(s, x, part, plus):
    """Analog 5 V; plus: the upper of both."""
    n = 7 if plus else 9
    inlet, out, noise = ("C909", "C908", "C907") if plus else ("C912", "C911", "C910")
    net = "A5+" if plus else "A5-"
    y = 760
    s.ic(part, x, y - 40, 160, 150, ["l 40 8 IN", "l 80 5 EN", "l 120 4,9 GND", "r 40 1 OUT", "r 100 2 FB", "d 30 6 NR", "d 80 3 NC", "d 120 7 DNC"],
         part + "\n" + s.board[part].value[:9])
    s.link((x - 112, y), (x - 22, y))
    s.link(f"{part}.5", (x - 42, y + 40), (x - 42, y))
    s.two(inlet, (x - 112, y), (x - 112, y + 80), "left")
    s.name("V+" if plus else "V-", x - 112, y, "l")
    s.two(noise, (x + 30, y + 132), (x + 30, y + 200))
    s.link(f"{part}.1", (x + 440, y))
    s.two(f"R90{n}", (x + 230, y), (x + 230, y + 60))
    s.link(f"{part}.2", (x + 230, y + 60))
    s.two(f"R9{n + 1:02}", (x + 230, y + 60), (x + 230, y + 130))
    s.two(out, (x + 330, y), (x + 330, y + 80))
    s.test_point("TP904" if plus else "TP905", x + 400, y)
    s.name(net, x + 440, y, "r")


def supply(parts):
    s = Schematic(1340, 1220, "Supply", parts)
    s.ic("J901", 60, 80, 150, 450, ["r 40 1 A+", "r 100 2 A-", "r 340 3 B+", "r 400 4 B-"], "J901\nconverters\n24 V to 11.5 V,\nisolated")
    _fuse(s, 120, "A")
    _fuse(s, 420, "B")
    s.test_point("TP901", 1170, 120)
    _regulator(s, 160, "U903", True)
    _regulator(s, 840, "U904", False)
    s.ic("U905", 200, 1010, 170, 80, ["l 40 3 IN", "r 40 1 OUT", "d 85 2"], "U905\nUA78L05")
    s.link((90, 1050), (178, 1050))
    s.two("C913", (130, 1050), (130, 1120), "left")
    s.name("PGND", 90, 1050, "l")
    s.link((392, 1050), (560, 1050))
    s.two("C914", (450, 1050), (450, 1120))
    s.test_point("TP903", 515, 1050)
    s.name("VDIG", 560, 1050, "r")
    s.ic("NT901", 740, 1030, 130, 40, ["l 20 1", "r 20 2"])
    for x, part in ((1010, "TP902"), (1100, "TP906"), (1200, "TP907")):
        s.test_point(part, x, 1050)
    s.note(300, 45, "24 V desktop supply with a fuse T 4 A, two isolated converters of 320 kHz.\nEach fuse opens above 12 V: a failed converter does not reach the OPA564. Capacitors at dVdT: slopes of the outputs.")
    return s


def sheets(parts):
    """Drawn sheets by file name."""
    found = {f"power-stage-{k}.svg": power_stage(parts, k) for k in (1, 2, 3)}
    found.update({"reference.svg": reference(parts), "enable.svg": enable(parts), "preamplifiers.svg": preamplifiers(parts),
                  "controller.svg": controller(parts), "supply.svg": supply(parts)})
    return {name: sheet.finish() for name, sheet in found.items()}


def errors_of(parts):
    """Of the sheets; see schematic.errors()."""
    return errors(sheets(parts), parts)
