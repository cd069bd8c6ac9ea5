"""The line: a package imports only what lies before it, and asking a knowledge base loads little."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import ROOT

PACKAGE = ROOT / "ersatz"
LINE = ["acquisition", "grounding", "knowledge", "reasoner", "pipeline", "evaluation", "service"]
EVERYWHERE = {"errors", "measurements", "resources", ""}
END = {"cli", "display"}
RDF = {"rdflib", "pyoxigraph", "owlready2", "oxrdflib", "pyshacl", "sssom"}
LEARNING = {"sklearn", "open3d", "scipy", "matplotlib"}
MODULES = sorted(PACKAGE.rglob("*.py"))


def imports(path: Path) -> Iterator[tuple[str, bool]]:
    """Yield (module imported, whether at the top of the module)."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    typing_only = {
        id(node)
        for block in ast.walk(tree)
        if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING"
        for node in ast.walk(block)
    }
    top = {id(node) for node in tree.body}
    for node in ast.walk(tree):
        if id(node) in typing_only:
            continue
        if isinstance(node, ast.Import):
            yield from ((alias.name, id(node) in top) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield str(node.module), id(node) in top


def part(module: str) -> str:
    """Return the first name below ersatz: the package or module of the line."""
    return module.removeprefix("ersatz").strip(".").split(".")[0]


def own(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def test_the_walk_sees_the_package() -> None:
    assert len(MODULES) > 30
    seen = {own(path) for path in MODULES}
    assert {"acquisition", "grounding", "knowledge", "reasoner", "pipeline", "cli"} <= seen
    assert ("pyoxigraph", True) in set(imports(PACKAGE / "knowledge" / "stores.py"))


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_go_one_way(path: Path) -> None:
    here = own(path)
    for module, _ in imports(path):
        if not module.startswith("ersatz"):
            continue
        there = part(module)
        if there in EVERYWHERE or there == here:
            continue
        if here in LINE:
            assert there in LINE, f"{path.name} imports {module}"
            assert LINE.index(there) < LINE.index(here), f"{path.name} imports {module}"
        else:
            assert here in END, f"{path.name} imports {module}"
            assert there in LINE or (here == "cli" and there in END), f"{path.name} imports {module}"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_libraries_stay_where_they_belong(path: Path) -> None:
    here = own(path)
    for module, at_top in imports(path):
        library = module.split(".")[0]
        if library in RDF:
            assert here in ("knowledge", "reasoner", "evaluation", "service"), f"{path.name} imports {module}"
        if library in LEARNING:
            assert here in ("acquisition", "grounding", "evaluation"), f"{path.name} imports {module}"
            needed = library == "scipy" and here == "acquisition"
            assert needed or not at_top, f"{path.name} imports {module} before it is needed"
        if library == "open3d":
            assert here == "acquisition", f"{path.name} imports open3d"


def test_no_cycles() -> None:
    names = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for path in MODULES
    }
    needs = {
        name: {module for module, at_top in imports(path) if at_top and module in names}
        for name, path in names.items()
    }
    done: set[str] = set()
    while ready := {name for name, before in needs.items() if before <= done} - done:
        done |= ready
    assert done == set(names), f"these import each other: {sorted(set(names) - done)}"


def loaded_by(code: str) -> set[str]:
    """Return the modules a fresh interpreter has after running the code."""
    script = f"{code}\nimport sys\nprint(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT
    )
    return set(done.stdout.splitlines()[-1].split())


HEAVY = {
    *("open3d", "sklearn", "scipy", "matplotlib", "polars", "rdflib", "owlready2"),
    *("fastapi", "nicegui", "starlette", "pydantic"),
}


def test_importing_ersatz_loads_nothing_heavy() -> None:
    assert not loaded_by("import ersatz") & (HEAVY | {"numpy", "pyoxigraph"})


def loaded_by_command(*arguments: str) -> set[str]:
    return loaded_by(
        "import sys, ersatz.cli.main\n"
        f"sys.argv = ['ersatz', *{arguments}]\n"
        "try:\n    ersatz.cli.main.main()\nexcept SystemExit as end:\n    assert not end.code, end.code\n"
    )


@pytest.mark.parametrize("form", [[], ["--json"]], ids=["text", "json"])
def test_asking_for_a_substitute_loads_nothing_heavy(form: list[str]) -> None:
    modules = loaded_by_command("substitute", "household", "--missing", "tray", *form)
    assert {"numpy", "pyoxigraph", "ersatz.cli.substitute"} <= modules
    assert not modules & (HEAVY | {"numpy.random"})


def test_a_file_can_be_parsed_before_numpy_is_loaded() -> None:
    modules = loaded_by("import ersatz.cli.main, ersatz.knowledge.opening as o; o.open_store('household')")
    assert "pyoxigraph" in modules
    assert not modules & {"numpy", "ersatz.knowledge.base"}


def test_a_command_loads_its_own_module_only() -> None:
    modules = loaded_by_command("show", "--help")
    assert "ersatz.cli.inspect" in modules
    assert not modules & {f"ersatz.cli.{other}" for other in ("build", "substitute", "share", "evaluate")}
    assert "numpy" not in modules
