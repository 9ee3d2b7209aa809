"""`python -m brushgs` is `brushgs`."""

import sys

from brushgs.cli import main

if __name__ == "__main__":
    sys.exit(main())
