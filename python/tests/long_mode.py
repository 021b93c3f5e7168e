"""The longer mode of the tests: see test/run.sh."""

import os
import random

LONG = "ADAPTIVE_BVH_LONG_TESTS" in os.environ
# Of this run's random numbers; None: hypothesis derives them from a test.
SEED = os.environ.get("ADAPTIVE_BVH_TEST_SEED") or (random.randrange(2**32) if LONG else None)
