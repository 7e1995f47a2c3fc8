"""``xgv-cosim bench`` on the command line: table, JSON, Markdown, and mistakes."""

from __future__ import annotations

import json

import pytest

from xgv_cosim.cli import main

SMALL = ("bench", "--network", "light_freeway", "--vehicles", "2", "--steps", "3", "--repeat", "1")


def code_of(*arguments: str) -> object:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return ended.value.code


def test_json_has_a_row_for_each_case(capsys: pytest.CaptureFixture[str]) -> None:
    """Issue 4.5: network, coupling, vehicles, ratio_to_plain, ratio_to_floor, emulator_us."""
    assert code_of(*SMALL, "--coupling", "free,lane", "--coupling", "lane", "--json") == 0
    said = capsys.readouterr()
    cases = json.loads(said.out)["cases"]
    assert [case["coupling"] for case in cases] == ["free", "lane"]
    for case in cases:
        assert (case["network"], case["vehicles"]) == ("light_freeway", 2)
        assert min(case["ratio_to_plain"], case["ratio_to_floor"], case["emulator_us"]) > 0.0
    assert said.err.splitlines() == [
        "1 of 2: light_freeway, free, 2 vehicles",
        "2 of 2: light_freeway, lane, 2 vehicles",
    ]


def test_the_table_shows_what_was_measured(capsys: pytest.CaptureFixture[str]) -> None:
    assert code_of(*SMALL, "--with", "metrics", "--quiet") == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert "ratio to floor" in said.out
    assert "light_freeway" in said.out
    assert "metrics" in said.out
    assert "medians of 1" in said.out


def test_markdown_is_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert code_of(*SMALL, "--markdown", "-q") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].startswith("| network | coupling | vehicles |")
    assert lines[4].startswith("| light_freeway | auto | 2 | 2 |")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--network", "town"), "network: got 'town'"),
        (("--vehicles", "0"), "vehicles: got 0"),
        (("--steps", "0"), "steps: got 0, expected 1 or more"),
        (("--repeat", "0"), "repeat: got 0, expected 1 or more"),
        (("--json", "--markdown"), "--json and --markdown exclude each other"),
        (("--vehicles", "100000", "--network", "busy_freeway"), "no room for 100000 vehicles"),
    ],
)
def test_a_mistake_is_exit_code_2(
    arguments: tuple[str, ...], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert code_of("bench", "-q", *arguments) == 2
    assert words in capsys.readouterr().err
