"""What JSON is, held against a schema of `docs/json`."""

from __future__ import annotations

from typing import Any

from jsonschema import Draft202012Validator


def violations(value: Any, schema: dict[str, Any]) -> list[str]:
    """What of a value is not as a schema says, and where."""
    Draft202012Validator.check_schema(schema)
    return [f"{it.json_path}: {it.message}" for it in Draft202012Validator(schema).iter_errors(value)]
