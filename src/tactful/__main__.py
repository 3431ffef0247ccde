import sys

from tactful.cli._app import main

sys.exit(main())
