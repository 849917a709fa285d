"""Names of what the parts of a take's training leave, known to who starts them."""

from __future__ import annotations

BASE = "base"
"""The part that comes first; the others are numbers of segments, from 0 on."""

PLAN = "plan.json"
"""What segments there are."""
