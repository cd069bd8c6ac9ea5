"""The mappings are SSSOM, and the same in Turtle and in the bridges."""

import re
from typing import Any

import pyoxigraph as ox
import pytest

from ersatz.knowledge import linking
from tests.knowledge.linked import store_of, triples
from tests.reasoners import ROOT, fetched

SSSOM_SCHEMA = "sssom-schema==1.0.0"
"""SSSOM's own schema (LinkML, 32 kB) without its dependencies; the `sssom` package brings 100."""


def test_mappings_are_valid_for_the_sssom_package() -> None:
    pytest.importorskip(
        "sssom", reason="pip install sssom brings 100 packages; the schema is checked without it"
    )
    from sssom.parsers import parse_sssom_table
    from sssom.validators import validate

    found = validate(parse_sssom_table(str(linking.MAPPINGS)), fail_on_error=False)
    assert [result for report in found.values() for result in report.results] == []


def schema() -> Any:
    yaml = pytest.importorskip("yaml", reason="PyYAML reads the schema of SSSOM")
    folder = fetched(SSSOM_SCHEMA, "sssom_schema", "ERSATZ_SSSOM_SCHEMA")
    return yaml.safe_load((folder / "schema" / "sssom_schema.yaml").read_text(encoding="utf-8"))


def faults(text: str, schema: Any) -> list[str]:
    """Return what SSSOM's schema forbids in a table: slots, required slots, values, CURIEs, prefixes."""
    head, table = (
        [line for line in text.splitlines() if line.startswith("#") == wanted] for wanted in (True, False)
    )
    prefixes, rows = linking.read_sssom(text)
    about = {match[1] for line in head if (match := re.match(r"#(\w+):", line))} - {"curie_map"}
    columns = set(table[0].split("\t"))
    slots, enums = schema["slots"], schema["enums"]
    required = {slot for slot in schema["classes"]["mapping"]["slots"] if slots[slot].get("required")}
    said = [f"no slot {name}" for name in about - set(schema["classes"]["mapping set"]["slots"])]
    said += [f"no column {name}" for name in columns - set(schema["classes"]["mapping"]["slots"])]
    said += [f"{name} is required" for name in required - columns]
    said += [f"{name} is required" for name in ("mapping_set_id", "license") if name not in about]
    for row in rows:
        for column, value in ((c, row[c]) for c in columns & set(slots)):
            kind = slots[column].get("range", "string")
            if column in required and not value:
                said.append(f"{row}: no {column}")
            if kind == "EntityReference" and not re.fullmatch(r"[\w.-]+:[^\s:]\S*", value):
                said.append(f"{value!r} is no CURIE")
            if kind == "EntityReference" and value.partition(":")[0] not in prefixes:
                said.append(f"{value!r} has no prefix in the curie_map")
            if value and kind in enums and value not in enums[kind]["permissible_values"]:
                said.append(f"{value!r} is no {kind}")
    return said


def test_mappings_keep_the_schema_of_sssom() -> None:
    text = linking.MAPPINGS.read_text(encoding="utf-8")
    assert faults(text, schema()) == []


@pytest.mark.parametrize(
    ("right", "wrong", "fault"),
    [
        ("#license", "#licence", "no slot licence"),
        ("\tmapping_justification\t", "\tjustification\t", "mapping_justification is required"),
        ("\tskos:closeMatch\tmls:Run", "\tcloseMatch\tmls:Run", "'closeMatch' is no CURIE"),
        ("#  mls:", "#  ml:", "'mls:Run' has no prefix in the curie_map"),
    ],
)
def test_a_fault_in_the_mappings_is_found(right: str, wrong: str, fault: str) -> None:
    text = linking.MAPPINGS.read_text(encoding="utf-8")
    assert right in text
    assert fault in faults(text.replace(right, wrong, 1), schema())


def test_mappings_and_their_turtle_agree() -> None:
    turtle = ROOT / "ontology" / "mappings" / "ersatz.ttl"
    assert turtle.read_text() == linking.mappings_as_turtle()
    stated = {
        t for t in triples(store_of(turtle)) if t.predicate.value.startswith("http://www.w3.org/2004/02/skos")
    }
    assert stated == set(linking.mapping_triples())
    assert len(stated) >= 100


def test_axioms_of_mappings_are_in_a_bridge() -> None:
    bridges = store_of(*sorted((ROOT / "ontology" / "bridges").glob("*.ttl")))
    axioms = [row for row in linking.mappings() if "rdf-schema" in row["predicate_id"]]
    assert len(axioms) >= 20
    for row in axioms:
        nodes = [ox.NamedNode(row[key]) for key in ("subject_id", "predicate_id", "object_id")]
        assert any(bridges.quads_for_pattern(*nodes)), row
