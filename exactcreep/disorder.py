"""The numbers that are drawn: `exactcreep.model.disorder` by its public name."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from exactcreep.model import disorder

if TYPE_CHECKING:
    from exactcreep.model.disorder import *  # noqa: F403

sys.modules[__name__] = disorder
