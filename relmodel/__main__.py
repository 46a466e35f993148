"""`python -m relmodel`: the command line."""

import sys

from relmodel.cli.main import main

sys.exit(main())
