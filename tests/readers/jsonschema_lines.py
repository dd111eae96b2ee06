"""Validates all lines by the JSON Schema of their export with jsonschema, and checks labels and landmarks."""

import json
import tarfile

from common import check, check_labels, check_landmarks, folders, read_lines
from jsonschema import Draft202012Validator


def shard_lines(folder):
    """Returns the JSON of all samples of a folder of shards."""
    for shard in sorted(folder.glob("*.tar")):
        with tarfile.open(shard) as files:
            for name in files.getnames():
                if name.endswith(".json"):
                    yield json.load(files.extractfile(name))


export, data = folders()
schemas = sorted(export.glob("*/schema.json"))
check(len(schemas) >= 5, f"{export} has {len(schemas)} schemas")
for path in schemas:
    schema = json.loads(path.read_text(encoding="utf-8"))
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    name, table = path.parent.name, path.parent / "pairs.jsonl"
    lines = read_lines(table) if table.exists() else list(shard_lines(path.parent))
    check_labels(name, lines, data)
    for line in lines:
        errors = [error.message for error in validator.iter_errors(line)]
        check(not errors, f"{name}: {line['id']}: {errors[:1]}")
    wrong = [{**lines[0], "id": None}, {**lines[0], "iou": "high"}, {key: lines[0][key] for key in lines[0] if key != "id"}]
    for line in wrong:
        check(not validator.is_valid(line), f"{name}: the schema accepts the wrong line {str(line)[:60]}")
    check_landmarks(name, data, lines)
