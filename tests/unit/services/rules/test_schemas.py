"""The JSON Schemas of the pack files are those of the Structs, and what is shipped fits them."""

import json
from pathlib import Path

import jsonschema  # type: ignore[import-untyped]
import pytest

from drivemcp.paths import data
from scripts.schemas import PACKS as FOLDER
from scripts.schemas import of_packs

PACKS = sorted(path.parent.name for path in data("rulepacks").glob("*/manifest.json"))


def test_the_schemas_are_in_step() -> None:
    written = {path.name: path.read_bytes() for path in FOLDER.glob("*.json")}
    assert written == of_packs(), "run: python scripts/schemas.py"


@pytest.mark.parametrize("name", ["manifest", "provisions", "signs", "cases"])
@pytest.mark.parametrize("pack", PACKS)
def test_what_is_shipped_fits_its_schema(pack: str, name: str) -> None:
    schema = json.loads((FOLDER / f"{name}.schema.json").read_text(encoding="utf-8"))
    content = json.loads(Path(data(f"rulepacks/{pack}") / f"{name}.json").read_text(encoding="utf-8"))
    jsonschema.validate(content, schema)


def test_the_schema_refuses_what_no_pack_may_say() -> None:
    schema = json.loads((FOLDER / "provisions.schema.json").read_text(encoding="utf-8"))
    provision = json.loads((data("rulepacks/DEU-v1") / "provisions.json").read_text(encoding="utf-8"))[5]
    wrong = [
        provision | {"effects": [{"type": "limit", "value": -5, "unit": "km/h"}]},
        provision | {"effects": [{"type": "limit", "value": 5, "unit": "knots"}]},
        provision | {"effects": [{"type": "limit", "value": 5, "unit": "km/h", "when": {"vehicle_classes": ["lory"]}}]},
        provision | {"surprise": 1},
        provision | {"id": "../x"},
    ]
    for entry in wrong:
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate([entry], schema)
