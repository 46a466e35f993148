"""The part of JSON Schema that `docs/json` uses, checked."""

from __future__ import annotations

from typing import Any

_TYPES: dict[str, tuple[type, ...]] = {
    "array": (list,),
    "boolean": (bool,),
    "integer": (int,),
    "null": (type(None),),
    "number": (int, float),
    "object": (dict,),
    "string": (str,),
}
_KNOWN = {
    "$schema", "title", "description", "type", "enum", "items", "minItems", "maxItems", "properties", "required",
    "additionalProperties", "minimum", "maximum",
}  # fmt: skip


def violations(value: Any, schema: dict[str, Any], at: str = "$") -> list[str]:
    """What of a value is not as a schema says, and where.  Raises ValueError for a keyword that is not known here."""
    if not schema.keys() <= _KNOWN:
        raise ValueError(f"{at}: unknown keywords {schema.keys() - _KNOWN}")
    kinds = schema.get("type", list(_TYPES))
    kinds = [kinds] if isinstance(kinds, str) else kinds
    if not any(isinstance(value, _TYPES[kind]) and (kind == "boolean" or type(value) is not bool) for kind in kinds):
        return [f"{at}: {value!r} is no {kinds}"]
    wrong = [f"{at}: {value!r} is none of {schema['enum']}"] if value not in schema.get("enum", [value]) else []
    if isinstance(value, int | float):
        if not schema.get("minimum", value) <= value <= schema.get("maximum", value):
            wrong.append(f"{at}: {value} is out of range")
    elif isinstance(value, list):
        if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
            wrong.append(f"{at}: has {len(value)} items")
        for i, inner in enumerate(value):
            wrong += violations(inner, schema.get("items", {}), f"{at}[{i}]")
    elif isinstance(value, dict):
        known, others = schema.get("properties", {}), schema.get("additionalProperties", True)
        wrong += [f"{at}: lacks {name}" for name in schema.get("required", ()) if name not in value]
        for name, inner in value.items():
            if name in known:
                wrong += violations(inner, known[name], f"{at}.{name}")
            elif others is False:
                wrong.append(f"{at}: has {name}, which the schema lacks")
            elif isinstance(others, dict):
                wrong += violations(inner, others, f"{at}.{name}")
    return wrong
