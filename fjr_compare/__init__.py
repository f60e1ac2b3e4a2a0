"""What changed: campaigns or diagnoses side by side, each beside the first.

Folders of either go in, a `result.Comparison` and its report come out. Begin with `comparing`.
`campaigns` compares BLAs, distortion and noise, `diagnoses` parameters, causes and gaps;
`statistics` holds the tests. All tests of a comparison share one rate of false alarms. `output`
writes the files: `words` are the sentences and tables, `compare_page` and `compare_plots` the page.

    >>> from fjr_compare import compare
    >>> found = compare(["rig", "rig"])
    >>> found.kind, found.changed, len(found.pairs[0].levels)
    ('campaigns', False, 2)
"""

from typing import TYPE_CHECKING

from fjr_kit.public_names import deferred_names

if TYPE_CHECKING:
    from .comparing import compare
    from .output import write_comparison
    from .result import Comparison
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = ["Comparison", "compare", "write_comparison"]
