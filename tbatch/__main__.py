"""``python -m tbatch`` equals ``tbatch``."""

from tbatch.cli import main

if __name__ == "__main__":
    main()
