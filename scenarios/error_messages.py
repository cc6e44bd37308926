"""One line that says what is wrong with a file: field, value and what is allowed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

_LIMITS = {
    "greater_than": ("gt", ">"),
    "greater_than_equal": ("ge", ">="),
    "less_than": ("lt", "<"),
    "less_than_equal": ("le", "<="),
}
_KINDS = {
    "float_type": "a number",
    "float_parsing": "a number",
    "int_parsing": "a whole number",
    "int_type": "a whole number",
    "string_type": "a text",
    "tuple_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "union_tag_not_found": "a table",
    "finite_number": "a finite number",
    "string_too_short": "a text that is not empty",
    "string_pattern_mismatch": "one line of text",
}


def first_error(error: ValidationError, model: type[BaseModel]) -> str:
    """The first thing that pydantic found wrong, in one line.

    Args:
        error: of pydantic.
        model: what was expected, to name the fields that are allowed.
    """
    found = error.errors(include_url=False)
    rest = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    # A misspelt field is often missing too; the misspelling is the better hint.
    first = min(found, key=lambda each: each["type"] != "extra_forbidden")
    return _line(dict(first), model) + rest


def near(name: str, names: Iterable[str]) -> str:
    """`; did you mean ...?` if one of `names` is like `name`, else nothing."""
    match = get_close_matches(name, list(names), n=1)
    return f"; did you mean {match[0]!r}?" if match else ""


def _line(found: dict[str, Any], model: type[BaseModel]) -> str:
    kind, loc, value = found["type"], tuple(found["loc"]), found["input"]
    context = found.get("ctx", {})
    if kind == "conflict":
        return ".".join(filter(None, [_path(loc), found["msg"]]))
    if kind == "refusal":
        return f"{_path(loc)}: {found['msg']}"
    if kind == "missing":
        if isinstance(loc[-1], int):
            return f"{_path(loc[:-1])}: {_short(value)} is too short; it needs at least {loc[-1] + 1} entries"
        return f"{_path(loc)}: is missing; it must be given"
    if kind == "extra_forbidden":
        names = _fields(loc[:-1], model)
        return f"{_path(loc)}: unknown field{near(str(loc[-1]), names)}; allowed: {', '.join(names)}"
    if kind == "union_tag_invalid":
        tags = context["expected_tags"]
        return f"{_path(loc)}.kind: {context['tag']!r} is none of {tags}{near(context['tag'], _words(tags))}"
    return f"{_path(loc)}: {_short(value)} {_allowed(kind, value, context, found['msg'])}"


def _allowed(kind: str, value: object, context: Mapping[str, Any], message: str) -> str:
    if kind in _LIMITS:
        name, sign = _LIMITS[kind]
        return f"is not allowed; it must be {sign} {context[name]:g}"
    if kind in _KINDS:
        return f"is not {_KINDS[kind]}"
    if kind == "literal_error":
        return f"is not {context['expected']}{near(str(value), _words(context['expected']))}"
    if kind in ("too_short", "too_long"):
        bound = f"at least {context['min_length']}" if kind == "too_short" else f"at most {context['max_length']}"
        return f"has {context['actual_length']} entries; it must have {bound}"
    return message.removeprefix("Value error, ")


def _path(loc: tuple[str | int, ...]) -> str:
    text = ""
    for i, part in enumerate(loc):
        if i == 1 and loc[0] == "gain":
            continue  # pydantic names the kind of gain here, the file has no such level
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def _fields(table: tuple[str | int, ...], model: type[BaseModel]) -> list[str]:
    """Names of the fields of a table, which is found by walking the models."""
    models = [model]
    for part in table:
        if isinstance(part, int):
            continue
        # Of several models for one field, pydantic names the one that was meant by its kind.
        tagged = [each for each in models if _is_kind(each, part)]
        models = tagged or [
            inner
            for each in models
            if part in each.model_fields
            for inner in _models_in(each.model_fields[part].annotation)
        ]
    return list(models[0].model_fields)


def _is_kind(model: type[BaseModel], part: str) -> bool:
    return "kind" in model.model_fields and part in get_args(model.model_fields["kind"].annotation)


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _models_in(inner)


def _words(expected: str) -> list[str]:
    return [word for word in expected.split("'") if word.strip(" ,") not in ("", "or")]


def _short(value: object) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."
