"""Substitution over HTTP: `/substitutes?missing=tray&available=plate`, described by OpenAPI."""

from collections.abc import Sequence
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Header, HTTPException, Query
from pydantic import BaseModel, ConfigDict, Field
from starlette.requests import Request

from ersatz.errors import ErsatzError, InputError, UnknownNameError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.confidence import DRAWS
from ersatz.reasoner.relevance import Combine, ReasonerSettings, Spacing
from ersatz.reasoner.representative import load_knowledge
from ersatz.reasoner.similarity import Similarity
from ersatz.reasoner.substitution import Ranking, rank_substitutes
from ersatz.service.inspection import RefusedError
from ersatz.service.service import Service

Name = Annotated[str, Field(min_length=1, max_length=300)]
_NUMBER: Final = "A number such as 0.35 or 1/3, kept exactly; without it, what is usual."
Number = Annotated[str | None, Query(max_length=40, description=_NUMBER)]
Written = Annotated[str | None, Field(max_length=40, description=_NUMBER)]

MOST_UNSURE: Final = 200
"""Candidates whose confidence is told: it takes many answers."""


class Problem(BaseModel):
    """What is wrong with a request."""

    detail: Any


class Evidence(BaseModel):
    """One quality and how often it was observed, as [times, out of]."""

    quality: str
    property: str
    tool_observed: list[int | float]
    observed: list[int | float]
    functions: list[str]
    weight: float | None = None


class Candidate(BaseModel):
    """One candidate and how it compares with the missing tool."""

    name: str
    iri: str
    kind: Literal["class", "instance"]
    similarity: float
    similarity_fraction: list[int] | None
    accepted: bool
    flags: list[str]
    shared: list[Evidence]
    lacking: list[Evidence]
    extra: list[Evidence]
    counterfactual: dict[str, Any]
    explanation: str
    aspects: list[dict[str, Any]] | None = None
    confidence: dict[str, Any] | None = None


class Substitutes(BaseModel):
    """The answer: candidates by similarity, then name; dimensionless numbers in [0, 1]."""

    version: int
    missing: str
    iri: str
    status: Literal["ok", "undetermined"]
    settings: dict[str, Any]
    revision: str
    reused: bool
    relevant_functional: list[str]
    relevant_physical: list[str]
    weights: dict[str, Any] | None = None
    substitutes: list[Candidate]


class Health(BaseModel):
    """That the service is there, and which state of knowledge it serves."""

    status: Literal["ok"]
    revision: str
    writable: bool


class Question(BaseModel):
    """A question for substitutes whose answer is to be remembered."""

    model_config = ConfigDict(extra="forbid")

    missing: Name
    available: Annotated[list[Name], Field(max_length=1000)] = []
    instances: Annotated[list[Name], Field(max_length=1000)] = []
    representative: Written = None
    tolerance: Written = None
    relevance_tolerance: Written = None
    combine: Combine = Combine.UNION
    similarity: Similarity | None = None
    graded: bool = False
    confidence: bool = False
    spacing: Spacing = Spacing.RANK
    certainty: Written = None
    above_lowest: bool = False
    fallback: bool = False
    properties: Annotated[str | None, Field(max_length=2000)] = None

    def settings(self) -> ReasonerSettings:
        """Return the reasoner's settings."""
        chosen = self.model_dump(exclude={"missing", "available", "instances", "confidence"})
        return ReasonerSettings.written(**chosen)


_PROBLEMS: dict[int | str, dict[str, Any]] = {
    400: {"model": Problem, "description": "A setting is not what it should be."},
    404: {
        "model": Problem,
        "description": "The knowledge base does not know a name; the nearest is offered.",
    },
}
_DENIED: dict[int | str, dict[str, Any]] = {
    401: {"model": Problem, "description": "The token is missing or wrong."},
    403: {"model": Problem, "description": "The service is read-only."},
    409: {"model": Problem, "description": "Another process writes."},
}


def rest_routes(service: Service) -> APIRouter:
    """Return the REST resources."""
    router = APIRouter()

    @router.get(
        "/substitutes",
        responses=_PROBLEMS,
        response_model_exclude_unset=True,
        summary="Which of the available things will do, and why?",
    )
    async def substitutes(
        request: Request,
        missing: Annotated[str, Query(min_length=1, max_length=300, description="The missing tool's class.")],
        available: Annotated[
            list[Name] | None, Query(max_length=1000, description="Classes at hand; without any: all.")
        ] = None,
        instance: Annotated[
            list[Name] | None, Query(max_length=1000, description="Instances at hand.")
        ] = None,
        representative: Number = None,
        tolerance: Number = None,
        relevance_tolerance: Number = None,
        combine: Combine = Combine.UNION,
        similarity: Annotated[
            Similarity | None, Query(description="jaccard (default), graded: ordinal (default).")
        ] = None,
        graded: Annotated[bool, Query(description="Reason with degrees, without a cut.")] = False,
        confidence: Annotated[
            bool, Query(description=f"Also tell how sure it is; of at most {MOST_UNSURE} candidates.")
        ] = False,
        spacing: Annotated[Spacing, Query(description="Of ordinal: as far apart as what?")] = Spacing.RANK,
        certainty: Number = None,
        above_lowest: bool = False,
        fallback: bool = False,
        properties: Annotated[
            str | None, Query(max_length=2000, description="paper, or names with commas.")
        ] = None,
        top: Annotated[int, Query(ge=1, le=1_000, description="Only so many.")] = 100,
    ) -> Substitutes:
        _refuse_unknown(request)
        chosen: dict[str, Any] = {
            "representative": representative,
            "tolerance": tolerance,
            "relevance_tolerance": relevance_tolerance,
            "combine": combine,
            "similarity": similarity,
            "graded": graded,
            "spacing": spacing,
            "certainty": certainty,
            "above_lowest": above_lowest,
            "fallback": fallback,
            "properties": properties,
        }

        def ask() -> dict[str, Any]:
            things, settings = (available, instance or ()), ReasonerSettings.written(**chosen)
            return rank(service.kb, missing, *things, settings, top=top, confidence=confidence).to_json()

        return Substitutes(**await _answered(service, ask))

    @router.post(
        "/substitutes",
        responses=_PROBLEMS | _DENIED,
        response_model_exclude_unset=True,
        summary="The same, written into the knowledge base",
    )
    async def remember(
        question: Question, authorization: Annotated[str, Header(max_length=1000)] = ""
    ) -> Substitutes:
        try:
            service.authorize(authorization)
            things = question.missing, question.available, question.instances
            found = await service.write(
                lambda: rank(
                    service.kb,
                    *things,
                    question.settings(),
                    confidence=question.confidence,
                    remember=True,
                )
            )
        except RefusedError as error:
            raise HTTPException(error.status, str(error), error.headers) from None
        return Substitutes(**found.to_json())

    @router.get("/health", summary="Is the service there?")
    async def health() -> Health:
        return Health(status="ok", revision=service.kb.revision, writable=service.settings.writable)

    return router


def rank(
    kb: KnowledgeBase,
    missing: str,
    available: Sequence[str] | None,
    instances: Sequence[str],
    settings: ReasonerSettings,
    *,
    top: int | None = None,
    confidence: bool = False,
    remember: bool = False,
) -> Ranking:
    """Rank for a stranger: how sure the answer is, is told of a bounded number of candidates.

    With remember it is written into the knowledge base, and so is how sure it is, where that is asked.

    Raises
    ------
    InputError
        If confidence is asked of more.
    """
    asked = len(available or ()) + len(instances) or len(kb.view(load_knowledge).classes.iris)
    if confidence and asked > MOST_UNSURE:
        raise InputError(
            f"confidence is asked of {asked} candidates: name at most {MOST_UNSURE} that are available"
        )
    draws = DRAWS if confidence else None
    things = available or None
    return rank_substitutes(
        kb, missing, things, instances=instances, settings=settings, top=top, draws=draws, remember=remember
    )


def _refuse_unknown(request: Request) -> None:
    """Refuse what would be passed over in silence, such as a setting that is misspelt."""
    known = {field.alias for field in request.scope["route"].dependant.query_params}
    for name in request.query_params:
        if name not in known:
            raise HTTPException(
                400, str(UnknownNameError("parameter", name, known, f"in {request.url.path}"))
            )


async def _answered(service: Service, ask: Any) -> dict[str, Any]:
    try:
        found: dict[str, Any] = await service.read(ask)
    except UnknownNameError as error:
        raise HTTPException(404, str(error)) from None
    except ErsatzError as error:
        raise HTTPException(400, str(error)) from None
    return found
