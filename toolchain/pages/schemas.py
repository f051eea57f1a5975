"""Page of the JSON and CSV outputs: keys, types and examples, from the output of the program itself."""
import csv
import json
import os
import subprocess
import tempfile

JSON_COMMANDS = {
    "run": ["run", "--duration", "1", "--json"],
    "serve --json-lines, convert --to jsonl (one line for each pose)": ["serve", "--json-lines", "-", "--duration", "1"],
    "motion": ["motion", "--example", "I", "--json"],
    "selfcheck": ["selfcheck", "--json"],
}
CSV_FILES = {
    "Poses of a simulated run (`run --out`). Files of a device and of `convert --to csv` have no true poses": ["run", "--duration", "1", "--out", "{csv}"],
    "Poses in other units (`--units mm --euler zyx`)": ["run", "--duration", "1", "--units", "mm", "--euler", "zyx", "--out", "{csv}"],
    "Examples of the paper (`motion --out`)": ["motion", "--example", "I", "--out", "{csv}"],
}


def flatten(value, key=""):
    """(path of the key, JSON type, example) of every leaf; of a list of objects the first one counts."""
    if isinstance(value, dict) and value:
        for name, part in value.items():
            yield from flatten(part, f"{key}.{name}" if key else name)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        yield from flatten(value[0], key + "[]")
    else:
        names = {bool: "boolean", int: "number", float: "number", str: "string", list: "array", dict: "object", type(None): "null"}
        text = json.dumps(value)
        yield key, names[type(value)], text if len(text) <= 60 else text[:57] + "..."


def table(head, rows):
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    return "\n".join(lines + ["| " + " | ".join(f"`{cell}`".replace("|", "\\|") if cell else "" for cell in row) + " |" for row in rows])


def json_section(program, title, words):
    out = subprocess.run([program, *words], check=True, capture_output=True, text=True).stdout
    value = json.loads(out.splitlines()[-1] if "--json-lines" in words else out)
    return f"## {title}\n\n{table(('key', 'type', 'example'), list(flatten(value)))}\n"


def csv_section(program, title, words):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "out.csv")
        subprocess.run([program, *(w.format(csv=path) for w in words)], check=True, stdout=subprocess.DEVNULL)
        with open(path) as file:
            rows = list(csv.reader(file))
    return f"## {title}\n\n{table(('column', 'example'), list(zip(rows[0], rows[-1])))}\n"


def page(program):
    parts = ["# JSON and CSV\n\nUnits are in the names: `_m`, `_mm`, `_rad`, `_deg`, `_us`, `_s`. Quaternions have the order w x y z and convert "
             "sensor components to source components. `null`: not available. Examples are of one run; a list of objects shows its first object.\n\n"
             "Files of recordings: [board/record](../board/record/README.md). Couplings of two bands: "
             "[Recordings of two bands](../core/tracking/METAL.md#recordings-of-two-bands).\n"]
    parts += [json_section(program, title, words) for title, words in JSON_COMMANDS.items()]
    parts += [csv_section(program, title, words) for title, words in CSV_FILES.items()]
    return "\n".join(parts)
