"""Hypothesis profiles: few or more examples, the same in every run, or new ones in each.

``default`` derives its examples from the tests alone, so that a run gives the same verdict on every
machine.  ``thorough`` derives more of them in the same way; ``make test-slow`` and ``make
test-nightly`` use it.  ``fuzz`` draws many new ones; ``make fuzz`` uses it.  ``mutants`` is
``default`` without the search for the smallest example that fails.
"""

from __future__ import annotations

from hypothesis import HealthCheck, Phase, settings


def register_profiles() -> None:
    """Register all profiles and load the default one; ``--hypothesis-profile`` overrides it."""
    # No deadlines and no check of speed: times say nothing on shared machines.
    for name, count in (("default", 12), ("thorough", 40)):
        settings.register_profile(
            name,
            max_examples=count,
            derandomize=True,
            deadline=None,
            suppress_health_check=[HealthCheck.too_slow],
        )
    settings.register_profile(
        "fuzz",
        max_examples=400,
        print_blob=True,
        deadline=None,
        suppress_health_check=list(HealthCheck),  # a check of the tests, not of the code
    )
    settings.register_profile(
        "mutants", settings.get_profile("default"), phases=[Phase.explicit, Phase.generate]
    )
    settings.load_profile("default")


def examples(share: float) -> settings:
    """Settings of a test whose examples cost more or less than most: a share of the profile's."""
    return settings(max_examples=max(1, round(share * settings().max_examples)))
