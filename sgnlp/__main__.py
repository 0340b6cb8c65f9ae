"""`python -m sgnlp` is the command `sgnlp`."""

from sgnlp.cli import main

main()
