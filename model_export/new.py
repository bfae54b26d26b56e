"""Start a template of a category of one's own: ``python -m model_export.new table``."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from service.mesh.frame import AUTO

STARTER = Path(__file__).with_name("starter.yaml")
NAME = re.compile("[a-z][a-z0-9_]{0,39}")


def starter(name: str, file: str) -> str:
    """The commented starter template, under a name.

    Args:
        name: of the category.
        file: that it will be written to, for the commands in its comments.

    Raises:
        ValueError: for a name that the API can't use.
    """
    if not NAME.fullmatch(name) or name == AUTO:
        raise ValueError(
            f"{name!r} is no name for a category: use small letters, digits and _, "
            f"a letter first, and not {AUTO!r}"
        )
    text = STARTER.read_text("utf-8")
    label = name.replace("_", " ").capitalize()
    for key, value in {"name": name, "label": label, "file": file}.items():
        text = text.replace(f"{{{{{key}}}}}", value)
    return text


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.new", description=__doc__)
    parser.add_argument("name", help="of the category: small letters, digits and _")
    parser.add_argument("--out", type=Path, help="file to write (default <name>.yaml)")
    parser.add_argument("--force", action="store_true", help="write over a file that is there")
    arguments = parser.parse_args()
    path = arguments.out or Path(f"{arguments.name}.yaml")
    try:
        text = starter(arguments.name, str(path))
        with path.open("w" if arguments.force else "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        parser.exit(1, f"{path} is there already; --force writes over it\n")
    except (OSError, ValueError) as error:
        parser.exit(1, f"{error}\n")
    print(f"wrote {path}; change it, then: python -m model_export.check {path} --out sheet.png")


if __name__ == "__main__":
    main()
