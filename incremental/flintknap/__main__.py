"""`python -m flintknap` is the command `flintknap`."""

from __future__ import annotations

from flintknap.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
