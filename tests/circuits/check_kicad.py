#!/usr/bin/python3
"""Builds a board with KiCad's module pcbnew from netlist.csv: every footprint exists, and its pads are those of the netlist.

  check_kicad.py [BOARD.kicad_pcb]     writes the board, all parts unplaced; the default writes none
Exit status 0: sound; 1: errors; 77: KiCad is missing. Uses Debian's Python, which has pcbnew."""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import netlist

try:
    import pcbnew
except ImportError:
    print("SKIPPED: pcbnew is missing: toolchain/install-deps full")
    sys.exit(77)
LIBRARIES = "/usr/share/kicad/footprints"


def load(part):
    library, name = part.footprint.split(":")
    return pcbnew.FootprintLoad(os.path.join(LIBRARIES, library + ".pretty"), name)


def build():
    """(board, errors)"""
    board, wrong, parts = pcbnew.BOARD(), [], netlist.parts()
    nets = {name: pcbnew.NETINFO_ITEM(board, name) for name in netlist.nets(parts)}
    for net in nets.values():
        board.Add(net)
    for number, part in enumerate(parts):
        footprint = load(part)
        if footprint is None:
            wrong.append(f"{part.designator}: no footprint {part.footprint}")
            continue
        footprint.SetReference(part.designator)
        footprint.SetValue(part.value)
        footprint.SetPosition(pcbnew.wxPointMM(25 * (number % 12), 25 * (number // 12)))
        pads = [pad for pad in footprint.Pads() if pad.GetNumber()]
        wrong += [f"{part.designator}: {part.footprint} has no pad {number}" for number in part.pads.keys() - {pad.GetNumber() for pad in pads}]
        for pad in pads:
            if pad.GetNumber() not in part.pads:
                wrong.append(f"{part.designator}: pad {pad.GetNumber()} of {part.footprint} is not in netlist.csv")
            elif part.pads[pad.GetNumber()] != netlist.OPEN:
                pad.SetNet(nets[part.pads[pad.GetNumber()]])
        board.Add(footprint)
    return board, wrong


def main():
    board, wrong = build()
    for line in wrong:
        print("FAIL", line)
    print(f"{len(board.GetFootprints())} parts, {board.GetNetCount() - 1} nets, {len(wrong)} failures")
    if len(sys.argv) > 1:
        pcbnew.SaveBoard(sys.argv[1], board)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
