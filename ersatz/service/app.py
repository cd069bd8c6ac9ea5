"""The application: made by a function, so that a test can make its own."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI
from starlette.middleware.cors import CORSMiddleware

from ersatz import __version__
from ersatz.knowledge.base import KnowledgeBase
from ersatz.service.endpoint import Endpoint, refused_methods
from ersatz.service.rest import rest_routes
from ersatz.service.safety import Guard
from ersatz.service.service import Service
from ersatz.service.settings import ServiceSettings


def create_app(kb: KnowledgeBase, settings: ServiceSettings | None = None) -> FastAPI:
    """Return the endpoint and the pages of a knowledge base as one application.

    Parameters
    ----------
    kb : KnowledgeBase
    settings : ServiceSettings, optional

    Raises
    ------
    InputError
        If it is to be writable and is the shipped one.
    """
    settings = settings or ServiceSettings()
    service = Service(kb, settings)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        async with asyncio.TaskGroup() as ready:
            ready.create_task(service.start())
            if settings.pages:
                from ersatz.service.pages.warming import warm

                ready.create_task(service.read(lambda: warm(kb)))
        try:
            yield
        finally:
            await service.stop()

    app = FastAPI(
        title="ERSATZ",
        version=__version__,
        summary="Which of the things at hand can stand in for a missing tool, and why.",
        docs_url=None,  # FastAPI's own pages load scripts from elsewhere
        redoc_url=None,
        lifespan=lifespan,
    )
    app.state.service = service
    app.router.routes.extend(Endpoint(service).routes())
    app.include_router(rest_routes(service))
    for path, allowed in (
        ("/substitutes", ("GET", "POST")),
        ("/health", ("GET",)),
        ("/openapi.json", ("GET", "HEAD")),
    ):
        app.router.routes.append(refused_methods(path, allowed))
    if settings.pages:
        from ersatz.service.pages import add_pages

        add_pages(app, service)
    if settings.origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=list(settings.origins),
            allow_methods=["GET", "HEAD", "POST"],
            allow_headers=["Accept", "Authorization", "Content-Type"],
            max_age=3600,
        )
    app.add_middleware(Guard, settings=settings)
    return app
