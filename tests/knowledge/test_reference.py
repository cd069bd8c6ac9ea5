"""The reference page holds every term and every question, and needs nothing from elsewhere."""

import re
from html.parser import HTMLParser

from ersatz.knowledge.reference import reference
from tests.reasoners import ROOT


class Page(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.anchors: list[str] = []
        self.links: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.anchors += [str(given["id"])] if "id" in given else []
        self.links += [str(given[key]) for key in ("href", "src") if key in given]
        if tag not in ("br", "meta"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_every_term_and_question_is_there() -> None:
    page = Page()
    page.feed(reference())
    assert page.open == []
    terms = set(re.findall(r"^:(\w+) a ", (ROOT / "ontology" / "ersatz.ttl").read_text(), re.MULTILINE))
    questions = {
        file.stem for file in [*(ROOT / "sparql").glob("*.rq"), *(ROOT / "sparql" / "linked").glob("*.rq")]
    }
    assert len(questions) >= 20
    assert terms | questions <= set(page.anchors)


def test_links_stay_on_the_page() -> None:
    page = Page()
    page.feed(reference())
    assert len(page.links) > 50
    assert {link.removeprefix("#") for link in page.links} <= set(page.anchors)


def test_the_page_is_the_same_every_time() -> None:
    assert reference() == reference()
