"""What the pages have in common: data and scripts that stand inside the page.

``drawing.js`` is the part that their scripts share.
"""

from __future__ import annotations

from pathlib import Path


def embedded(json: str) -> str:
    """Return ``json`` escaped for a script element, which ``</script>`` or ``<!--`` would end."""
    return json.replace("<", "\\u003c")


def with_drawing(script: Path) -> str:
    """Return the text of a script, after that of ``drawing.js``."""
    parts = (Path(__file__).with_name("drawing.js"), script)
    return "\n".join(part.read_text(encoding="utf-8") for part in parts)
