"""Requests to one server: a deadline for the whole answer, a login where it asks, one error a failure.

Secrets stand in a file in netrc's format, which names the host they are for: never in a URL, on a command
line or in a message.
"""

import netrc
import os
import sys
import threading
from base64 import b64encode
from collections.abc import Mapping
from http.client import HTTPException
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Final
from urllib.error import HTTPError
from urllib.parse import SplitResult, urlsplit
from urllib.request import (
    AbstractDigestAuthHandler,
    HTTPPasswordMgrWithDefaultRealm,
    Request,
    parse_http_list,
    parse_keqv_list,
    urlopen,
)

from ersatz.errors import InputError, KnowledgeBaseError
from ersatz.knowledge.stores import one_line

CREDENTIALS: Final = "ERSATZ_CREDENTIALS"
"""Environment variable that names the file of secrets."""


class Login:
    """A name and a password, or a bearer token, for one server; it answers Basic and Digest challenges.

    Parameters
    ----------
    server : str
        Its URL.
    user : str
        Empty for a bearer token.
    secret : str
    """

    def __init__(self, server: str, user: str, secret: str) -> None:
        self._user = user
        self._secret = secret
        self._scheme = "" if user else "bearer"
        self._challenge: Mapping[str, str] = {}
        passwords = HTTPPasswordMgrWithDefaultRealm()
        passwords.add_password(None, server, user, secret)
        self._digest = AbstractDigestAuthHandler(passwords)

    @classmethod
    def find(cls, url: str, file: Path | None = None) -> "Login | None":
        """Return what the file of secrets says of the URL's host, "host:port" before "host".

        Parameters
        ----------
        url : str
        file : Path, optional
            In netrc's format: `machine HOST login NAME password SECRET` on a line, without a `login` for a
            bearer token. Else the file that `ERSATZ_CREDENTIALS` names, if any.

        Raises
        ------
        InputError
            If the file cannot be read, or others may read it too.
        """
        named = file or (Path(os.environ[CREDENTIALS]) if os.environ.get(CREDENTIALS) else None)
        if named is None:
            return None
        try:
            if sys.platform != "win32" and named.stat().st_mode & 0o077:
                raise InputError(f"{str(named)!r} can be read by others: chmod 600 it")
            known = netrc.netrc(named).hosts
        except (OSError, UnicodeDecodeError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"cannot read the credentials in {str(named)!r}: {reason}") from None
        except netrc.NetrcParseError as error:  # whose message may quote a secret
            raise InputError(
                f"line {error.lineno} of {str(named)!r} is no line of a netrc file: "
                "write `machine HOST login NAME password SECRET`"
            ) from None
        parts = urlsplit(url)
        for host in (f"{parts.hostname}:{parts.port}", parts.hostname or ""):
            if host in known:
                user, _, secret = known[host]
                return cls(f"{parts.scheme}://{parts.netloc}/", user or "", secret or "")
        return None

    def challenged(self, header: str) -> bool:
        """Note how the server wants to be answered; tell whether it can be."""
        scheme, _, rest = header.partition(" ")
        self._scheme = scheme.lower()
        if self._scheme == "digest":
            self._challenge = parse_keqv_list(list(filter(None, parse_http_list(rest))))
        return self._scheme in ("basic", "digest") and bool(self._user)

    def sign(self, request: Request) -> None:
        """Add the answer to a request once the challenge is known; a redirect does not take it along."""
        answer: str | None = None
        if self._scheme == "bearer":
            answer = f"Bearer {self._secret}"
        elif self._scheme == "basic":
            answer = "Basic " + b64encode(f"{self._user}:{self._secret}".encode()).decode()
        elif self._scheme == "digest":
            found = self._digest.get_authorization(request, self._challenge)
            answer = found and f"Digest {found}"
        if answer:
            request.add_unredirected_header("Authorization", answer)


class Transport:
    """Sends requests, each with the login of its own host, and believes whole answers only.

    Parameters
    ----------
    timeout : float, seconds
    credentials : Path, optional
        The file of secrets; else the one that `ERSATZ_CREDENTIALS` names.
    """

    def __init__(self, timeout: float = 60.0, credentials: Path | None = None) -> None:
        self._timeout = timeout
        self._credentials = credentials
        self._logins: dict[str, Login | None] = {}

    def send(self, request: Request) -> tuple[bytes, str]:
        """Return the answer's body and media type.

        A socket's timeout starts anew with every byte, so a thread waits for the whole of it.

        Raises
        ------
        KnowledgeBaseError
            If the server cannot be reached in time, or answers with an error or in part.
        """
        if request.host not in self._logins:
            self._logins[request.host] = Login.find(request.full_url, self._credentials)
        login = self._logins[request.host]
        answers: SimpleQueue[tuple[bytes, str] | KnowledgeBaseError] = SimpleQueue()
        threading.Thread(
            target=lambda: answers.put(self._exchange(request, login)), daemon=True, name="ersatz-remote"
        ).start()
        try:
            answer = answers.get(timeout=self._timeout)
        except Empty:
            raise KnowledgeBaseError(
                f"{request.full_url!r} did not answer within {self._timeout:g} s: ask for less, "
                "or try again later"
            ) from None
        if isinstance(answer, KnowledgeBaseError):
            raise answer
        return answer

    def _exchange(
        self, request: Request, login: Login | None, *, again: bool = True
    ) -> tuple[bytes, str] | KnowledgeBaseError:
        """Return the answer to a request, or what went wrong."""
        url = request.full_url
        try:
            if login is not None:
                login.sign(request)
            with urlopen(request, timeout=self._timeout) as answer:
                return answer.read(), answer.headers.get_content_type()
        except HTTPError as error:
            challenge = error.headers.get("WWW-Authenticate", "")
            if error.code == 401 and again and login is not None and login.challenged(challenge):
                return self._exchange(request, login, again=False)
            return KnowledgeBaseError(f"{url!r} answered {error.code} {error.reason}{_reason(error)}")
        except HTTPException as error:
            return KnowledgeBaseError(f"{url!r} broke off its answer: {one_line(repr(error))}")
        except (OSError, ValueError) as error:
            return KnowledgeBaseError(f"cannot reach {url!r}: {one_line(error)}")


def checked(url: str) -> SplitResult:
    """Return the parts of a server's URL; raise where it is none."""
    try:
        parts = urlsplit(url)
        whole = parts.scheme in ("http", "https") and parts.hostname and parts.port != 0
    except ValueError:
        whole = None
    if not whole or not url.isascii() or " " in url:
        raise InputError(f"{url!r} is not the URL of a SPARQL endpoint: give http://host/path")
    if parts.username is not None:
        raise InputError(
            f"the URL of {parts.hostname!r} holds a name: write it into a file in netrc's format, "
            f"and set {CREDENTIALS} to the file's path"
        )
    return parts


def _reason(error: HTTPError) -> str:
    """Return the beginning of what an error's page says."""
    try:
        words = one_line(error.read(400).decode(errors="replace"))
    except (HTTPException, OSError):
        return ""
    return f": {words}" if words else ""
