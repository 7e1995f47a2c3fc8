"""Constraints, citation and licence agree with pyproject.toml; no file names a machine."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from ruamel.yaml import YAML

from xgv_cosim import __version__

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PACKAGES = ("jaus", "sumo_scenarios", "xgv_cosim")
PIN = re.compile(r"(?P<name>[A-Za-z0-9._-]+)==(?P<version>[A-Za-z0-9.!+_-]+)")
TEXT_SUFFIXES = {
    "",
    ".cff",
    ".md",
    ".py",
    ".sumocfg",
    ".toml",
    ".txt",
    ".xml",
    ".yaml",
    ".html",
    ".css",
    ".js",
    ".j2",
}


def pins() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    matches = [PIN.fullmatch(line) for line in lines if line and not line.startswith("#")]
    assert all(matches), "constraints.txt holds a line that is no exact version"
    return {canonicalize_name(match["name"]): match["version"] for match in matches if match}


def requirements() -> list[str]:
    return [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["dev"]]


@pytest.mark.parametrize("line", requirements())
def test_every_requirement_is_pinned_to_a_version_that_it_allows(line: str) -> None:
    requirement = Requirement(line)
    version = pins()[canonicalize_name(requirement.name)]
    assert requirement.specifier.contains(version)


def imported_modules(folder: Path) -> set[str]:
    """Return the top-level modules that the sources below a folder import, at the top or in a function."""
    modules: set[str] = set()
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                modules |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
                modules.add(node.module.split(".")[0])
    return modules


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_that_is_imported_is_declared(package: str) -> None:
    """What only another package happens to bring may go away with that package's next version."""
    extras = [
        line for name, lines in PROJECT["optional-dependencies"].items() if name != "dev" for line in lines
    ]
    declared = {canonicalize_name(Requirement(line).name) for line in [*PROJECT["dependencies"], *extras]}
    foreign = imported_modules(ROOT / package) - set(sys.stdlib_module_names) - set(PACKAGES)
    bringers = packages_distributions()  # knows nothing of wheels that list no modules, such as ruckig's
    undeclared = {
        module
        for module in foreign
        if declared.isdisjoint(map(canonicalize_name, bringers.get(module, [module])))
    }
    assert undeclared == set()


def test_citation_names_this_version_and_licence() -> None:
    citation = YAML(typ="safe").load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["cff-version"] == "1.2.0"
    assert {"message", "title", "authors", "type"} <= set(citation)
    assert citation["version"] == __version__
    assert citation["license"] == PROJECT["license"]


def test_changelog_tells_of_this_version() -> None:
    assert __version__ in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_licence_is_the_one_declared() -> None:
    text = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert PROJECT["license"] == "Apache-2.0"
    assert "Apache License" in text
    assert "Version 2.0" in text


def project_files() -> Iterator[Path]:
    for name in ("xgv_cosim", "jaus", "sumo_scenarios", "tests", "examples", "docs", ".ci"):
        yield from (path for path in (ROOT / name).rglob("*") if "__pycache__" not in path.parts)
    for name in ("pyproject.toml", "constraints.txt", "README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE"):
        yield ROOT / name


def test_no_file_names_a_folder_of_some_machine() -> None:
    """Neither this checkout's place, nor anybody's home folder."""
    folders = [str(ROOT), str(Path.home()), *(f"/{name}/" for name in ("root", "home", "Users"))]
    places = [re.compile(rf"(?<![\w.]){re.escape(folder)}") for folder in folders if folder.count("/") > 1]
    found = [
        f"{path.relative_to(ROOT)}: {place.pattern}"
        for path in project_files()
        if path.is_file() and path.suffix in TEXT_SUFFIXES
        for place in places
        if place.search(path.read_text(encoding="utf-8"))
    ]
    assert found == []
