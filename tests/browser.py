"""A browser without a screen: prints a page, or tells what a script finds in it."""

from __future__ import annotations

import json
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
_OPTIONS = ("--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=10000")

_READER = """<script>
addEventListener("load", async () => {
  const find = (text) => document.querySelector(text), found = {};
  const rest = () => new Promise((done) => setTimeout(done, 100));
  const plots = [...document.querySelectorAll(".plot")];
  %s
  document.body.innerHTML = `<pre id="found"></pre>`;
  find("#found").textContent = JSON.stringify(found);
});
</script></body>"""


class _Found(HTMLParser):
    """Reads what the script has left in the page."""

    text = ""
    inside = False

    def handle_starttag(self, tag, attrs):
        self.inside = ("id", "found") in attrs

    def handle_data(self, data):
        self.text += data if self.inside else ""


def chromium(*arguments: str) -> str:
    """Return what the browser prints."""
    assert CHROMIUM is not None
    done = subprocess.run(
        [CHROMIUM, *_OPTIONS, *arguments], capture_output=True, text=True, timeout=120, check=True
    )
    return done.stdout


def found_in(page: Path, script: str) -> dict[str, Any]:
    """Return what a script writes into `found` after the page has loaded.

    It may call `find` (an element), `rest` (a promise of 100 ms), and read `plots`.
    """
    probed = page.with_name("probed.html")
    text = page.read_text("utf-8").replace("</body>", _READER % script)
    probed.write_text(text, encoding="utf-8")
    reader = _Found()
    reader.feed(chromium("--window-size=1000,900", "--dump-dom", probed.as_uri()))
    return json.loads(reader.text)
