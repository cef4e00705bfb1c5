"""The window of ``render_mode="human"``; needs the extra ``human`` (pygame-ce)."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from ppg_env.errors import InputError


class Window:
    """A window of its own for each viewer, so that closing one leaves the others alone."""

    def __init__(self, title: str, size: tuple[int, int], fps: float) -> None:
        pygame = _need_display()
        self._window = pygame.Window(title, size)
        self._clock, self._fps = pygame.time.Clock(), fps

    def is_open(self) -> bool:
        """Whether the user has left it open; closes whatever the user has asked to close."""
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
        """Put up a picture (H, W, 3), and ``wait`` until the next one is due."""
        import pygame

        height, width = picture.shape[:2]
        image = pygame.image.frombuffer(picture.tobytes(), (width, height), "RGB")
        self._window.get_surface().blit(image, (0, 0))
        self._window.flip()
        if wait:
            self._clock.tick(self._fps)

    def close(self) -> None:
        """Close it; closing it twice is harmless."""
        self._window.destroy()


def _need_display() -> Any:
    """The pygame module, with a display to show things on."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # keep standard output clean
    try:
        import pygame
        from pygame import Window  # noqa: F401 - which the older pygame has not
    except ImportError:
        raise InputError(
            "render_mode 'human'", "needs pygame-ce", "install path-planning-games[human]"
        ) from None
    try:
        pygame.display.init()
        driver = pygame.display.get_driver()
    except pygame.error:
        driver = "offscreen"
    # SDL draws into the void where it finds no display, unless it was told to.
    if driver == "offscreen" and os.environ.get("SDL_VIDEODRIVER") != "offscreen":
        pygame.display.quit()
        raise InputError(
            "render_mode 'human'", "finds no display", "set DISPLAY, or use 'rgb_array'"
        )
    return pygame
