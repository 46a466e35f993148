"""`python -m relmodel`: the command line."""

import sys

from relmodel.app.cli.main import main

sys.exit(main())
