"""Where the sources lie, and data that only some machines have."""

from __future__ import annotations

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
SHARED = Path(os.environ.get("FJR_SHARED", ROOT.parent / "shared"))
"""Records of real rigs, beside the checkout; a test that needs one skips where it is not."""
