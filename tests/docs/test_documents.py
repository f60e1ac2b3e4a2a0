"""The documents as text: nothing that a merge has left behind."""

from __future__ import annotations

from collections import Counter

import pytest
from paths import ROOT

DOCUMENTS = sorted(
    file.relative_to(ROOT).as_posix()
    for pattern in ("*.md", "docs/**/*.md", "benchmarks/*.md")
    for file in ROOT.glob(pattern)
)
LONG = 40
"""Characters from which a line of prose is not the same as another by chance."""


@pytest.mark.parametrize("document", DOCUMENTS)
def test_no_line_of_prose_stands_twice(document: str):
    lines = (ROOT / document).read_text(encoding="utf-8").splitlines()
    prose = [line for line in lines if not line.startswith(("    ", "|")) and len(line) > LONG]
    assert [line for line, times in Counter(prose).items() if times > 1] == []
