"""Downloading one file: in pieces, resumed where it broke off, and whole when it bears its name."""

import http.client
import shutil
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeAlias

from ersatz.errors import InputError

Progress: TypeAlias = Callable[[str, int, int], None]
"""Told the file's name, the bytes here and the bytes in all; 0 in all if the server does not say."""

CHUNK: Final = 1 << 20
"""Bytes read at a time."""

PATIENCE: Final = 60.0
"""Seconds without a byte after which a server is given up."""


def download(address: str, path: Path, progress: Progress | None = None) -> None:
    """Fetch one file, going on where an earlier try stopped.

    What has come stands in `<path>.part` until all of it is there; `<path>.version` names the version it is
    of, so that a file the publisher changes in between is begun anew and not patched together.

    Raises
    ------
    InputError
        If the server cannot be reached, refuses or breaks off, or the disk is too small. What has come is
        kept.
    """
    part, version = path.with_name(f"{path.name}.part"), path.with_name(f"{path.name}.version")
    have = part.stat().st_size if part.is_file() else 0
    try:
        with urllib.request.urlopen(_request(address, have, version), timeout=PATIENCE) as answer:
            _receive(answer, part, version, progress)
    except urllib.error.HTTPError as error:
        # 416: nothing is left to fetch, the earlier try stopped just before the renaming.
        if error.code != 416 or not have:
            raise InputError(f"{address}: the server answers {error.code} {error.reason}") from error
    except (OSError, ValueError, http.client.HTTPException) as error:
        have = part.stat().st_size if part.is_file() else 0
        reason = getattr(error, "reason", error)
        reason = getattr(reason, "strerror", None) or reason
        raise InputError(f"{address}: {reason}; {have} bytes are kept, fetch again to go on") from error
    part.replace(path)
    version.unlink(missing_ok=True)


def _request(address: str, have: int, version: Path) -> urllib.request.Request:
    headers = {"Range": f"bytes={have}-"} if have else {}
    if have and version.is_file() and (mark := version.read_text(encoding="utf-8")):
        headers["If-Range"] = mark
    return urllib.request.Request(address, headers=headers)


def _receive(answer: http.client.HTTPResponse, part: Path, version: Path, progress: Progress | None) -> None:
    resumed = answer.status == 206
    have = part.stat().st_size if resumed else 0
    coming = int(answer.headers.get("Content-Length") or 0)
    free = shutil.disk_usage(part.parent).free
    if coming > free:
        raise OSError(f"{coming:,} bytes are to come and {free:,} are free on the disk")
    # A weak tag does not promise the same bytes.
    tag = answer.headers.get("ETag", "")
    mark = answer.headers.get("Last-Modified", "") if not tag or tag.startswith("W/") else tag
    total = have + coming if coming else 0
    with part.open("ab" if resumed else "wb") as file:
        version.write_text(mark, encoding="utf-8")
        while chunk := answer.read(CHUNK):
            file.write(chunk)
            have += len(chunk)
            if progress is not None:
                progress(part.stem, have, total)
    if have < total:
        raise OSError(f"the connection ended after {have} of {total} bytes")
