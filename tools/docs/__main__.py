"""Write the tables of the documents from the code: `make docs`."""

import sys

from tools.docs.pages import PAGES, fresh


def main() -> int:
    """Write every page that is stale, and say which."""
    for path in PAGES:
        text = fresh(path.read_text())
        if text != path.read_text():
            path.write_text(text)
            print(f"written: {path.name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
