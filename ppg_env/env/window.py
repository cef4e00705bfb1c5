"""The window of ``render_mode="human"``; needs the extra ``human`` (pygame-ce)."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from ppg_env.errors import InputError


class Window:
    """The window of one viewer; closing it does not affect other windows."""

    def __init__(self, title: str, size: tuple[int, int], fps: float) -> None:
        pygame = _need_display()
        self._window = pygame.Window(title, size)
        self._clock, self._fps = pygame.time.Clock(), fps

    def is_open(self) -> bool:
        """Process pending close events and return whether this window is still open."""
        import pygame

        for event in pygame.event.get():
            if event.type == pygame.WINDOWCLOSE and event.window is not None:
                event.window.destroy()
        try:
            self._window.get_surface()
        except pygame.error:
            return False
        return True

    def show(self, picture: np.ndarray, *, wait: bool) -> None:
        """Show a picture (H, W, 3); with ``wait``, sleep until the next frame is due."""
        import pygame

        height, width = picture.shape[:2]
        image = pygame.image.frombuffer(picture.tobytes(), (width, height), "RGB")
        self._window.get_surface().blit(image, (0, 0))
        self._window.flip()
        if wait:
            self._clock.tick(self._fps)

    def close(self) -> None:
        """Close the window; a second call has no effect."""
        self._window.destroy()


def _need_display() -> Any:
    """Return the pygame module with an initialised display."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # keep standard output clean
    try:
        import pygame
        from pygame import Window  # noqa: F401 - missing in the older pygame
    except ImportError:
        raise InputError(
            "render_mode 'human'", "needs pygame-ce", "install path-planning-games[human]"
        ) from None
    try:
        pygame.display.init()
        driver = pygame.display.get_driver()
    except pygame.error:
        driver = "offscreen"
    # Without a display SDL falls back to off-screen drawing, which is an error unless requested.
    if driver == "offscreen" and os.environ.get("SDL_VIDEODRIVER") != "offscreen":
        pygame.display.quit()
        raise InputError(
            "render_mode 'human'", "finds no display", "set DISPLAY, or use 'rgb_array'"
        )
    return pygame
