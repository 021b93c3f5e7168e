"""The command adaptive_bvh: `adaptive_bvh clearance ...`, also `python -m adaptive_bvh clearance`."""

import sys

from ._clearance import main

if __name__ == "__main__":
    sys.exit(main())
