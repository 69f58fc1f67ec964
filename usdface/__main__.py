"""``python -m usdface``."""

import sys

from usdface.cli import main

sys.exit(main())
