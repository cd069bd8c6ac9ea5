"""The endpoint: SPARQL 1.1 Protocol, service description and Graph Store reads."""

from collections.abc import Awaitable, Callable, Mapping
from typing import Final
from urllib.parse import quote

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import Route

from ersatz.errors import UnknownNameError
from ersatz.knowledge import vocabulary as v
from ersatz.service.answers import evaluated, refusal
from ersatz.service.description import service_description
from ersatz.service.frames import Job
from ersatz.service.inspection import GRAPHS, Dataset, RefusedError, inspect_query, inspect_update
from ersatz.service.negotiation import GRAPHS as GRAPH_FORMATS
from ersatz.service.negotiation import best_graph, best_table, wants_page
from ersatz.service.requests import (
    FORM,
    QUERY,
    UPDATE,
    decoded,
    fields,
    media_type,
    one,
    query_fields,
    read_body,
)
from ersatz.service.service import Service

Handler = Callable[[Request], Awaitable[Response]]

METHODS: Final = ["GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS", "TRACE"]
TERMS: Final = frozenset({v.ONTOLOGY.value, v.ERSATZ})
_DATASET: Final = ("default-graph-uri", "named-graph-uri")
_UPDATE_DATASET: Final = ("using-graph-uri", "using-named-graph-uri")


class Endpoint:
    """The handlers of the protocol over one service."""

    def __init__(self, service: Service) -> None:
        self._service = service

    def routes(self) -> list[Route]:
        """Return the routes."""
        served: list[tuple[str, Handler, tuple[str, ...]]] = [
            ("/sparql", self.sparql, ("GET", "HEAD", "POST")),
            ("/query", self.sparql, ("GET", "HEAD", "POST")),
            ("/update", self.update, ("POST",)),
            ("/data", self.graph, ("GET", "HEAD")),
            ("/kb", self.knowledge_base, ("GET", "HEAD")),
            ("/kb/{name}", self.thing, ("GET", "HEAD")),
        ]
        return [Route(path, _guarded(handler, allowed), methods=METHODS) for path, handler, allowed in served]

    async def sparql(self, request: Request) -> Response:
        """Answer a query; without one, describe the service; refer updates to their handler."""
        url = query_fields(request)
        if request.method in ("GET", "HEAD"):
            if "update" in url:
                raise RefusedError(405, "an update is sent with POST", {"Allow": "POST"})
            if "query" not in url:
                return self._described(request)
            return await self._query(request, one(url, "query"), url)
        media = media_type(request)
        if media == UPDATE:
            return await self.update(request)
        body = await self._body(request)
        if media == QUERY:
            return await self._query(request, decoded(body), url)
        if media == FORM:
            form = _form(body)
            if "update" in form and "query" not in form:
                return await self._update(request, one(form, "update"), form)
            if "query" in url:
                raise RefusedError(400, "a POST has its query in the body, not in the URL")
            return await self._query(request, one(form, "query"), form)
        raise RefusedError(415, f"the body is {media or 'of no type'!r}: send {QUERY}, {UPDATE} or {FORM}")

    async def update(self, request: Request) -> Response:
        """Make an update, if the service is writable and the client has the token."""
        self._service.authorize(request.headers.get("authorization", ""))
        media = media_type(request)
        if media not in (UPDATE, FORM):
            raise RefusedError(415, f"the body is {media or 'of no type'!r}: send {UPDATE} or {FORM}")
        body = await self._body(request)
        if media == UPDATE:
            return await self._update(request, decoded(body), query_fields(request))
        form = _form(body)
        return await self._update(request, one(form, "update"), form)

    async def graph(self, request: Request) -> Response:
        """Read a graph by SPARQL 1.1 Graph Store Protocol: the default graph, or one by its name."""
        url = query_fields(request)
        if ("default" in url) == ("graph" in url):
            raise RefusedError(400, "say which graph: ?default or ?graph=IRI")
        if "default" in url or one(url, "graph") in GRAPHS:
            return await self._dump(request, "dump", "")
        if one(url, "graph") in TERMS:
            return await self._dump(request, "terms", "")
        raise RefusedError(404, f"there are the graphs {v.KB_ONTOLOGY.value} and {v.ONTOLOGY.value}")

    async def knowledge_base(self, request: Request) -> Response:
        """Answer the IRI of the knowledge base itself: its pages, or all its triples."""
        if self._service.settings.pages and wants_page(request.headers.get("accept", "")):
            return RedirectResponse("/", 303, headers={"Vary": "Accept"})
        return await self._dump(request, "dump", "")

    async def thing(self, request: Request) -> Response:
        """Answer the IRI of one thing: its page, or its triples."""
        name = request.path_params["name"]
        iri = v.KB + name
        try:
            known = iri if await self._service.knows(iri) else ""
        except (UnknownNameError, ValueError):
            known = ""
        if not known:
            raise RefusedError(404, "nothing in this knowledge base has that name")
        if self._service.settings.pages and wants_page(request.headers.get("accept", "")):
            return RedirectResponse(f"/thing/{quote(name, safe='')}", 303, headers={"Vary": "Accept"})
        return await self._dump(request, "describe", iri)

    async def _query(self, request: Request, text: str, parameters: Mapping[str, list[str]]) -> Response:
        dataset = Dataset(*(tuple(parameters.get(name, ())) for name in _DATASET))
        inspect_query(text, dataset, self._service.settings.depth)
        accept = request.headers.get("accept", "")
        job = self._service.job("query", text, best_table(accept), best_graph(accept))
        if job.table is None and job.graph is None:
            raise RefusedError(406, "accept JSON, XML, CSV or TSV, or Turtle, N-Triples, JSON-LD or RDF/XML")
        return await self._run(request, job)

    async def _update(self, request: Request, text: str, parameters: Mapping[str, list[str]]) -> Response:
        self._service.authorize(request.headers.get("authorization", ""))
        for name in _UPDATE_DATASET:
            for graph in parameters.get(name, ()):
                if graph not in GRAPHS:
                    raise RefusedError(403, "there is only the default graph")
        inspect_update(text, self._service.settings.depth)
        await self._service.update(text)
        return Response(status_code=204)

    async def _dump(self, request: Request, action: str, text: str) -> Response:
        media = best_graph(request.headers.get("accept", ""))
        if media is None:
            raise RefusedError(406, f"accept {', '.join(GRAPH_FORMATS)}")
        return await self._run(request, self._service.job(action, text, None, media))

    def _described(self, request: Request) -> Response:
        accept = request.headers.get("accept", "")
        if self._service.settings.pages and wants_page(accept):
            return RedirectResponse("/ask", 303, headers={"Vary": "Accept"})
        media = best_graph(accept)
        if media is None:
            raise RefusedError(406, f"accept {', '.join(GRAPH_FORMATS)}")
        body = service_description(str(request.url.replace(query="")), media)
        return Response(body, headers={"Content-Type": media, "Vary": "Accept"})

    async def _run(self, request: Request, job: Job) -> Response:
        settings = self._service.settings
        return await evaluated(request, self._service.pool, job, settings.body_seconds)

    async def _body(self, request: Request) -> bytes:
        settings = self._service.settings
        return await read_body(request, settings.body_bytes, settings.body_seconds)


def _form(body: bytes) -> dict[str, list[str]]:
    try:
        return fields(body.decode("ascii"))
    except UnicodeDecodeError:
        raise RefusedError(400, "the form is not ASCII: percent-encode it") from None


def _guarded(handler: Handler, allowed: tuple[str, ...]) -> Handler:
    async def guarded(request: Request) -> Response:
        try:
            if request.method not in allowed:
                raise not_allowed(allowed)
            return await handler(request)
        except RefusedError as error:
            return refusal(error)

    return guarded


def not_allowed(allowed: tuple[str, ...]) -> RefusedError:
    """Return the refusal of a method; routes take all, lest the pages answer what they do not know."""
    return RefusedError(405, f"only {', '.join(allowed)} here", {"Allow": ", ".join(allowed)})


def refused_methods(path: str, allowed: tuple[str, ...]) -> Route:
    """Return a route that refuses whatever methods are left on a path."""

    async def refuse(_: Request) -> Response:
        return refusal(not_allowed(allowed))

    return Route(path, refuse, methods=[method for method in METHODS if method not in allowed])
