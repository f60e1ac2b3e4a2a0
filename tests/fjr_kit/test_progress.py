"""The line of progress on narrow and wide terminals, and sentences above it."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from fjr_kit.progress import ProgressLine

AMOUNT, WHAT = "29/60 s simulated 1.0 x real time", "level 1 of 2, realization 5 of 5"


def shown(width: int, terminal: bool = True) -> str:
    console = Console(width=width, file=io.StringIO(), force_terminal=terminal, color_system=None)
    with ProgressLine(console, total=60.0) as line:
        line._update(completed=29.0, amount=AMOUNT, description=WHAT)
        line.say("a sentence of many words " * 5)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


@pytest.mark.parametrize(("width", "bar"), [(80, False), (120, True)])
def test_no_word_of_the_line_is_cut(width, bar):
    text = shown(width)
    assert AMOUNT in text and WHAT in text and "\N{HORIZONTAL ELLIPSIS}" not in text
    assert ("\N{BOX DRAWINGS HEAVY HORIZONTAL}" in text) == bar


def test_a_sentence_breaks_between_words_on_a_terminal_and_is_one_line_in_a_log():
    assert max(line.count("sentence") for line in shown(80).splitlines()) == 3
    assert max(line.count("sentence") for line in shown(80, terminal=False).splitlines()) == 5
