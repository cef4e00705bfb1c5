"""Pages as a reader's browser shows them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Page


@contextmanager
def reading(browser: Browser, path: Path, **options: object) -> Iterator[Page]:
    """The page in ``path``, opened; at the end, nothing was asked of others or complained of."""
    asked: list[str] = []
    said: list[str] = []
    page = browser.new_page(**options)
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto(path.as_uri())
    yield page
    page.close()
    assert [url for url in asked if not url.startswith("data:")] == [path.as_uri()]
    assert said == []
