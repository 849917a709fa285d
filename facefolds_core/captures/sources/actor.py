"""The embedded actor: `capture` has written it as a Multiface capture, with masks."""

from __future__ import annotations

from facefolds_core.captures.sources.multiface import read

__all__ = ["read"]
