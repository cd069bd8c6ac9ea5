"""Reading requests strictly: bodies, forms and parameters by SPARQL 1.1 Protocol, section 2."""

import asyncio
from collections.abc import Mapping
from typing import Final
from urllib.parse import parse_qsl

from starlette.requests import ClientDisconnect, Request

from ersatz.service.inspection import RefusedError

FORM: Final = "application/x-www-form-urlencoded"
QUERY: Final = "application/sparql-query"
UPDATE: Final = "application/sparql-update"
MOST_FIELDS: Final = 100


async def read_body(request: Request, most: int, seconds: float) -> bytes:
    """Return the body of a request.

    Raises
    ------
    RefusedError
        413 if it is larger than `most` bytes, 408 if it takes longer than `seconds`.
    """
    declared = request.headers.get("content-length", "0")
    if not declared.isdigit() or int(declared) > most:
        raise RefusedError(413, f"the body is larger than {most} bytes", {"Connection": "close"})
    body = bytearray()
    try:
        async with asyncio.timeout(seconds):
            async for piece in request.stream():
                body += piece
                if len(body) > most:
                    raise RefusedError(413, f"the body is larger than {most} bytes", {"Connection": "close"})
    except TimeoutError:
        raise RefusedError(408, f"the body did not come in {seconds:g} s", {"Connection": "close"}) from None
    except ClientDisconnect:
        raise RefusedError(400, "the client hung up") from None
    return bytes(body)


def fields(encoded: str) -> dict[str, list[str]]:
    """Return the parameters of a query string or form, by name.

    Raises
    ------
    RefusedError
        400 if they are no UTF-8, or too many.
    """
    try:
        pairs = parse_qsl(
            encoded, keep_blank_values=True, errors="strict", max_num_fields=MOST_FIELDS, encoding="utf-8"
        )
    except UnicodeDecodeError:
        raise RefusedError(400, "the parameters are not UTF-8") from None
    except ValueError:
        raise RefusedError(400, f"there are more than {MOST_FIELDS} parameters") from None
    found: dict[str, list[str]] = {}
    for name, value in pairs:
        found.setdefault(name, []).append(value)
    return found


def query_fields(request: Request) -> dict[str, list[str]]:
    """Return the parameters in a request's URL."""
    try:
        return fields(request.scope["query_string"].decode("ascii"))
    except UnicodeDecodeError:
        raise RefusedError(400, "the URL is not ASCII: percent-encode it") from None


def decoded(body: bytes) -> str:
    """Return a body as text.

    Raises
    ------
    RefusedError
        400 if it is no UTF-8.
    """
    try:
        return body.decode("utf-8")
    except UnicodeDecodeError:
        raise RefusedError(400, "the body is not UTF-8") from None


def one(parameters: Mapping[str, list[str]], name: str) -> str:
    """Return the only value of a parameter.

    Raises
    ------
    RefusedError
        400 if there is none, or several.
    """
    values = parameters.get(name, [])
    if len(values) != 1:
        count = "no" if not values else str(len(values))
        raise RefusedError(400, f"there must be one parameter {name!r}, and there is {count}")
    return values[0]


def media_type(request: Request) -> str:
    """Return the media type of a body.

    Raises
    ------
    RefusedError
        415 if it says another character set than UTF-8.
    """
    media, *parameters = request.headers.get("content-type", "").split(";")
    for parameter in parameters:
        name, _, value = parameter.strip().partition("=")
        if name.lower() == "charset" and value.strip('"').lower() not in ("utf-8", "utf8", "us-ascii"):
            raise RefusedError(415, f"the character set {value!r} is not served: send UTF-8")
    return media.strip().lower()
