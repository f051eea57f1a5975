"""Schemas of what the option --json prints: board/host/schema/COMMAND.json. The number at the end of $id changes if a key goes or changes its
type; a new key needs no new number."""
import json
import pathlib

FOLDER = pathlib.Path(__file__).resolve().parent.parent.parent / "board/host/schema"


def schema_of(values):
    """The schema of several values of one place."""
    kinds = {"object": [v for v in values if isinstance(v, dict)], "array": [v for v in values if isinstance(v, list)],
             "string": [v for v in values if isinstance(v, str)], "boolean": [v for v in values if isinstance(v, bool)],
             "integer": [v for v in values if isinstance(v, int) and not isinstance(v, bool)], "null": [v for v in values if v is None]}
    numbers = [v for v in values if isinstance(v, float)]
    if numbers or (kinds["null"] and not any(kinds[kind] for kind in ("object", "array", "string", "boolean"))):
        kinds.update(number=numbers or kinds["null"], integer=[], null=[True])  # a number that is not finite is null
    types = sorted(kind for kind, found in kinds.items() if found)
    schema = {"type": types[0] if len(types) == 1 else types}
    if kinds["object"]:
        names = list(dict.fromkeys(name for v in kinds["object"] for name in v))
        schema["properties"] = {name: schema_of([v[name] for v in kinds["object"] if name in v]) for name in names}
        schema["required"] = [name for name in names if all(name in v for v in kinds["object"])]
    items = [item for v in kinds["array"] for item in v]
    if items:
        schema["items"] = schema_of(items)
    return schema


def write(outputs):
    """outputs: {command: [what it printed]}"""
    FOLDER.mkdir(exist_ok=True)
    for command, values in outputs.items():
        head = {"$schema": "http://json-schema.org/draft-07/schema#", "$id": f"urn:tricoil:{command}:1",
                "title": f"Output of tricoil {command.replace('-', ' ', 1)} --json"}
        (FOLDER / f"{command}.json").write_text(json.dumps({**head, **schema_of(values)}, indent=1) + "\n")


def faults(outputs):
    """One line for each output that does not suit its schema."""
    if not outputs:
        return
    import jsonschema
    for command, values in outputs.items():
        path = FOLDER / f"{command}.json"
        if not path.exists():
            yield f"tricoil {command} --json: no schema {path.name}"
            continue
        checker = jsonschema.Draft7Validator(json.loads(path.read_text()))
        for error in (error for value in values for error in checker.iter_errors(value)):
            yield f"tricoil {command} --json: {'/'.join(map(str, error.absolute_path)) or 'result'}: {error.message[:200]}"
