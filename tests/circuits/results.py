"""Reads and writes board/nucleo_g474re/circuits/results.csv: results of the netlists, for the pages and for models of the board."""
import csv
import os

from spice import CIRCUITS

PATH = os.path.join(CIRCUITS, "results.csv")


def read():
    with open(PATH) as file:
        return {row["result"]: float(row["value"]) for row in csv.DictReader(file)}


def write(results):
    with open(PATH, "w") as file:
        file.write("result,value\n")
        for name, value in results.items():
            file.write(f"{name},{value:.5g}\n")


def differences(fresh, stored):
    """Names with values that differ by more than 1 %, and names in only one of the two."""
    found = [name for name in fresh.keys() ^ stored.keys()]
    for name in fresh.keys() & stored.keys():
        if abs(fresh[name] - stored[name]) > 0.01 * max(abs(fresh[name]), abs(stored[name])) + 1e-12:
            found.append(f"{name}: {fresh[name]:.5g}, stored {stored[name]:.5g}")
    return sorted(found)
