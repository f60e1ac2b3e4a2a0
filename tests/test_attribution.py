"""When a gap counts as explained."""

from __future__ import annotations

import pytest

from gap_diagnosis.attribution import STANDS_OUT, stands_out


@pytest.mark.parametrize(
    ("left", "refit", "rival", "out"),
    [
        (10.0, 300.0, 280.0, True),  # another form of the catalogue's law
        (9.0, 350.0, 19.0, True),  # next comes the same effect on the other side
        (6.5, 55.0, 10.0, False),  # one of several substitutes
        (70.0, 770.0, 200.0, False),
        (2.1, 3.7, 2.9, False),
    ],
)
def test_an_explanation_that_leaves_a_lot_must_stand_out(left, refit, rival, out):
    assert (stands_out(left, refit, rival) > STANDS_OUT) is out
