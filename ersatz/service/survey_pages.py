"""The pages of the survey: one question at a time, plain HTML without scripts, nothing from elsewhere."""

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, quote, urlsplit

from ersatz.errors import ErsatzError, MissingDependencyError
from ersatz.evaluation.pictures import picture
from ersatz.evaluation.scenarios import NONE
from ersatz.evaluation.survey import Question, Survey

if TYPE_CHECKING:
    from fastapi import FastAPI, Request, Response

STYLE = """
body{font:17px/1.5 system-ui,sans-serif;max-width:60em;margin:3em auto;padding:0 1em;color:#1b1b1b}
.options{display:flex;flex-wrap:wrap;gap:1em;margin:1.5em 0}
label{border:2px solid #ccc;border-radius:8px;padding:.8em;width:10em;text-align:center;cursor:pointer}
label:has(:checked){border-color:#0072B2;background:#eef5fb}label img{display:block;width:100%}
button{font:inherit;padding:.5em 1.5em;background:#0072B2;color:white;border:0;cursor:pointer}
button{border-radius:8px}progress{width:100%}.error{color:#B00020}input[type=text]{font:inherit;width:8em}
""".strip()


def create_survey_app(survey: Survey, scans: Mapping[str, Path] | None = None) -> "FastAPI":
    """Return the application.

    Parameters
    ----------
    survey : Survey
    scans : mapping of class to a scan to render, optional
        See `ersatz.evaluation.pictures.find_scans`.

    Raises
    ------
    MissingDependencyError
        If FastAPI is not installed.
    """
    try:
        from fastapi import FastAPI, Request, Response
        from fastapi.responses import HTMLResponse, RedirectResponse
    except ImportError as error:
        raise MissingDependencyError(f"the survey needs FastAPI ({error}): install ersatz[serve]") from None
    app = FastAPI(title="ERSATZ survey", docs_url=None, redoc_url=None, openapi_url=None)
    known, drawn = dict(scans or {}), dict[str, bytes]()

    @app.get("/")
    def welcome() -> Response:
        return HTMLResponse(_page("What would you take?", _welcome(len(survey.scenarios))))

    @app.post("/begin")
    async def begin(request: Request) -> Response:
        if _foreign(request):
            return HTMLResponse(_page("Not from here", ""), 403)
        expert = (await _form(request)).get("expert", "") or survey.new_expert()
        return RedirectResponse(f"/e/{quote(expert)}", 303)

    @app.get("/e/{expert}")
    def ask(expert: str) -> Response:
        return _question(survey, expert, known, "")

    @app.post("/e/{expert}")
    async def answer(expert: str, request: Request) -> Response:
        if _foreign(request):
            return HTMLResponse(_page("Not from here", ""), 403)
        form = await _form(request)
        if not form.get("choice"):
            return _question(survey, expert, known, "Please choose one, or “none of these”.")
        try:
            survey.vote(expert, form.get("scenario", ""), form["choice"])
        except ErsatzError as error:
            return HTMLResponse(_page("That did not work", f"<p class=error>{escape(str(error))}</p>"), 400)
        return RedirectResponse(f"/e/{quote(expert)}", 303)

    @app.get("/picture/{name}")
    def show(name: str) -> Response:
        if name not in known:
            return Response(status_code=404)
        if name not in drawn:
            drawn[name] = picture(known[name])
        return Response(drawn[name], media_type="image/png")

    return app


def serve_survey(app: "FastAPI", host: str = "127.0.0.1", port: int = 8000) -> None:
    """Serve until interrupted.

    Raises
    ------
    MissingDependencyError
        If uvicorn is not installed.
    """
    try:
        import uvicorn
    except ImportError as error:
        raise MissingDependencyError(f"the survey needs uvicorn ({error}): install ersatz[serve]") from None
    uvicorn.run(app, host=host, port=port, log_level="warning")


def _question(survey: Survey, expert: str, known: Mapping[str, Path], complaint: str) -> "Response":
    from fastapi.responses import HTMLResponse

    try:
        question = survey.next(expert)
    except ErsatzError as error:
        return HTMLResponse(_page("That did not work", f"<p class=error>{escape(str(error))}</p>"), 400)
    if question is None:
        text = "<p id=done>All questions are answered, and every answer is saved.</p>"
        return HTMLResponse(_page("Thank you", f"{text}<p><a href='/'>Next expert</a></p>"))
    return HTMLResponse(_page(question.scenario.missing, _form_of(question, expert, known, complaint)))


def _form_of(question: Question, expert: str, known: Mapping[str, Path], complaint: str) -> str:
    s = question.scenario
    options = "".join(_option(name, known) for name in question.options)
    warning = f"<p class=error>{escape(complaint)}</p>" if complaint else ""
    task = f" {escape(s.task)}" if s.task else ""
    return (
        f"<progress max={question.total} value={question.number - 1}></progress>"
        f"<p>Question {question.number} of {question.total}. Your id is <code "
        f"id=expert>{escape(expert)}</code>: "
        "with it you can stop and go on later.</p>"
        f"<p><b>You need a {escape(s.missing)}, but it is not here.</b>{task} Which of these would you "
        f"take instead?</p>"
        f"{_image(s.missing, known, 160)}{warning}<form method=post action='/e/{quote(expert)}'>"
        f"<input type=hidden name=scenario value='{escape(s.id)}'><div class=options>{options}"
        f"<label><input type=radio name=choice value='{NONE}'> none of these</label></div>"
        "<button>Next</button></form>"
    )


def _option(name: str, known: Mapping[str, Path]) -> str:
    return (
        f"<label>{_image(name, known, 140)}<input type=radio name=choice value='{escape(name)}'> "
        f"{escape(name)}</label>"
    )


def _image(name: str, known: Mapping[str, Path], width: int) -> str:
    if name not in known:
        return ""
    return f"<img src='/picture/{quote(name, safe='')}' alt='{escape(name)}' width={width}>"


def _welcome(count: int) -> str:
    return (
        f"<p>A robot misses a tool. {count} times we name the tool and a few objects that are at hand: "
        f"choose the one "
        "you would take instead, or none. There is no right or wrong; nothing but your choices is kept.</p>"
        "<form method=post action='/begin'><button>Begin</button> or go on with your id "
        "<input type=text name=expert pattern='[a-z0-9]{1,32}'></form>"
    )


def _page(title: str, body: str) -> str:
    return (
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{escape(title)}</title>"
        f"<meta name=viewport "
        f"content='width=device-width'><style>{STYLE}</style><h1>{escape(title)}</h1>{body}</html>"
    )


async def _form(request: "Request") -> dict[str, str]:
    body = (await request.body())[:100_000].decode("utf-8", "replace")
    return {name: values[-1] for name, values in parse_qs(body).items()}


def _foreign(request: "Request") -> bool:
    """Return whether another site's page sent the request."""
    origin = request.headers.get("origin")
    return origin not in (None, "null") and urlsplit(origin).netloc != request.headers.get("host")
