"""`tricoil calibrate wiring`: coil and polarity of each channel, from a sensor at a known position."""

import itertools
import os

import numpy as np

from ._coupling_table import read_couplings
from ._output_file import OutputFile, refuse_input_as_output
from ._wiring import Wiring

DISTINCT = 0.08  # minimum of the magnitudes of the direction's components, and of their differences
MOST_MISFIT = 0.3  # of a certain wiring; the second best has this much more: SECOND_SHARE, SECOND_MISFIT
SECOND_SHARE, SECOND_MISFIT = 1.5, 0.02
TWIN = 1e-12  # all six coils reversed: the same couplings
ORDERS = [tuple(sign * coil for sign, coil in zip(signs, order))
          for order in itertools.permutations((1, 2, 3)) for signs in itertools.product((1, -1), repeat=3)]


def _direction(at):
    values = [float(value) for value in at.split(",")] if isinstance(at, str) else np.asarray(at, float).ravel()
    direction = np.array(values)
    length = np.linalg.norm(direction)
    if direction.shape != (3,) or not 0 < length < np.inf:
        raise ValueError("--at needs the direction of the sensor as X,Y,Z, not zero")
    direction /= length
    size = np.sort(abs(direction))
    if min(size[0], *np.diff(size)) < DISTINCT:
        raise ValueError("--at: several wirings give the same couplings in that direction; choose a direction away from all axes and diagonals, "
                         "for example 0.4,0.2,0.1")
    return direction


def identify(couplings, at) -> tuple[Wiring, float, float]:
    """The wiring that explains couplings (N, 3, 3) of a sensor in the direction `at`, its axes parallel to those of the source, and the shares of
    the couplings that it and the second best do not explain. Compares all 48 orders and signs of each side with 3 u u^T - 1, the ideal dipole."""
    direction = _direction(at)
    ideal = (3 * np.outer(direction, direction) - np.eye(3)) / np.sqrt(6)
    measured = np.sum(couplings / np.linalg.norm(couplings, axis=(1, 2), keepdims=True), axis=0)
    measured /= np.linalg.norm(measured)
    matrices = np.array([Wiring._matrix(order) for order in ORDERS])
    explained = np.einsum("aij,jk,blk->abil", matrices, ideal, matrices)
    misfit = np.linalg.norm(explained - measured, axis=(2, 3))
    twins = misfit < misfit.min() + TWIN
    reversed_coils = (np.array(ORDERS) < 0).sum(axis=1)
    a, b = np.unravel_index(np.argmin(np.where(twins, reversed_coils[:, None] + reversed_coils, 7)), misfit.shape)
    return Wiring(ORDERS[a], ORDERS[b]), float(misfit.min()), float(misfit[~twins].min())


def _text_of(order):
    if order == (1, 2, 3):
        return "straight"
    return ", ".join(f"channel {n} = coil {abs(coil)}{' reversed' if coil < 0 else ''}" for n, coil in enumerate(order, 1))


def _refuse_repeated(files):
    seen = set()
    for path in map(os.fspath, files):
        place = os.path.realpath(path)
        if place in seen:
            raise ValueError(f"{path}: given twice; give each file once")
        seen.add(place)


def run(files, at, out=None) -> dict:
    """What `tricoil calibrate wiring --json` prints. out: file for a wiring that is certain. Raises ValueError; OSError if a disk fails."""
    _refuse_repeated(files)
    refuse_input_as_output({"--out": out}, files)
    wiring, misfit, second = identify(np.concatenate([read_couplings(path) for path in files]), at)
    is_certain = misfit < MOST_MISFIT and second > SECOND_SHARE * misfit + SECOND_MISFIT
    if out is not None and is_certain:
        with OutputFile(os.fspath(out)) as file:
            file.write(f"# Coil of each channel; negative: reversed.\nsensor = {list(wiring.sensor)}\nsource = {list(wiring.source)}\n")
            file.commit()
    return {"sensor": _text_of(wiring.sensor), "source": _text_of(wiring.source), "misfit": misfit, "second_misfit": second,
            "certain": bool(is_certain), "straight": wiring == Wiring()}


def text(r: dict) -> str:
    return f"sensor: {r['sensor']}\nsource: {r['source']}\nmisfit {r['misfit']:.3f}; next best wiring {r['second_misfit']:.3f}\n"


def reason(r: dict, out) -> str | None:
    """Why the command ends with exit code 1; None: it does not."""
    if not r["certain"]:
        return ("no wiring fits clearly better than the others; is the sensor at the position given by --at, with axes parallel to those of the "
                "source?" + ("" if out is None else f" {out} is not written"))
    if out is None and not r["straight"]:
        return ("the wiring is not straight: exchange and reverse the coils as above, or write it with --out FILE and give that file to the other "
                "commands with --wiring FILE")
    return None
