"""``python -m xgv_cosim``: the command line."""

from xgv_cosim.cli import main

main()
