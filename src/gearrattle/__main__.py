"""``python -m gearrattle``: the command line where the script ``gearrattle`` is not on the path."""

from gearrattle.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
