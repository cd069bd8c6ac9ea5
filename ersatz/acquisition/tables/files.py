"""Reading a file as a whole: bytes, text or TOML, and the `Source` that tells which file it was."""

import gzip
import hashlib
import tomllib
import zlib
from pathlib import Path
from typing import Any, Final

from ersatz.errors import InputError
from ersatz.measurements import Source

GZIP: Final = b"\x1f\x8b"
UTF16: Final = (b"\xff\xfe", b"\xfe\xff")


def read_bytes(path: Path, credit: str = "") -> tuple[bytes, Source]:
    """Return a file's content, unpacked if it is gzipped, and its source.

    Returns
    -------
    bytes
        The content; the SHA-256 of the source is that of the file as it lies on disk.
    Source

    Raises
    ------
    InputError
        If the file is missing, a directory, unreadable, empty, or a damaged gzip.
    """
    if path.is_dir():
        raise InputError(f"{str(path)!r} is a directory: give the file in it")
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        raise InputError(
            f"there is no file {str(path)!r}: check the name and the working directory"
        ) from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {str(path)!r}: {getattr(error, 'strerror', None) or error}") from None
    source = Source(path.name, hashlib.sha256(raw).hexdigest(), credit)
    if raw.startswith(GZIP):
        try:
            raw = gzip.decompress(raw)
        except (OSError, EOFError, zlib.error) as error:
            raise InputError(
                f"{path.name!r} is a damaged gzip file ({error}): pack or copy it again"
            ) from None
    elif path.suffix.lower() == ".gz":
        raise InputError(f"{path.name!r} is called .gz but is not gzipped: rename it or pack it")
    if not raw.strip():
        raise InputError(f"{path.name!r} is empty: give a file with content")
    return raw, source


def without_bom(raw: bytes, name: str) -> bytes:
    """Return UTF-8 text as bytes without its byte order mark.

    Raises
    ------
    InputError
        If the content is UTF-16, binary, or in another encoding than UTF-8.
    """
    if raw.startswith(UTF16):
        raise InputError(f"{name!r} is encoded in UTF-16: save it as UTF-8")
    zero = raw.find(b"\0")
    if zero >= 0:
        raise InputError(f"{name!r} is not a text file: it has a zero byte at offset {zero}; give UTF-8 text")
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        byte = raw[error.start : error.start + 1]
        raise InputError(
            f"{name!r}, line {line}: the byte 0x{byte.hex()} is not UTF-8; save the file as UTF-8"
        ) from None
    return raw.removeprefix(b"\xef\xbb\xbf")


def read_toml(path: Path, credit: str = "") -> tuple[dict[str, Any], Source]:
    """Return a TOML file as a dictionary, and its source.

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML; the message tells the line.
    """
    raw, source = read_bytes(path, credit)
    try:
        return tomllib.loads(without_bom(raw, path.name).decode("utf-8")), source
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path.name!r} is not TOML: {error}; correct the line") from None
