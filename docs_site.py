"""What mkdocs adds to docs/: the drawing of the signs, and references that are read from the code."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parent
SIGNS = "signs.svg"


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Add the pages that no file holds."""
    made: dict[str, str | bytes] = {
        "elements.md": elements_page(),
        "commands.md": commands_page(),
        "design-keys.md": design_keys_page(),
        SIGNS: (ROOT / "identification" / SIGNS).read_bytes(),
    }
    for name, content in made.items():
        files.append(File.generated(config, name, content=content))
    return files


def on_page_markdown(markdown: str, *, page: Page, config: MkDocsConfig, files: Files) -> str:
    """In the repository the drawing stands beside the code that draws the sheet; here beside the pages."""
    return markdown.replace(f"../identification/{SIGNS}", SIGNS)


def elements_page() -> str:
    """A section for each path, an entry for each element."""
    from identification.physical.elements import CATALOGUE, PATHS
    from identification.physical.elements.described import element_text

    parts = ["# Elements", "What a physical model can be made of, as `damper-rig elements NAME` prints it."]
    for path in PATHS:
        parts.append(f"## The {path} path")
        here = (spec for spec in CATALOGUE.values() if spec.path == path)
        parts += [f"### {spec.name}\n\n```text\n{element_text(spec)}\n```" for spec in here]
    return "\n\n".join(parts) + "\n"


def design_keys_page() -> str:
    """Every key of a design's configuration."""
    from excitation.design_keys import COMMANDS, keys_text

    parts = ["# Keys of designs", "As `damper-rig design --explain-keys` prints them."]
    return "\n\n".join([*parts, *(f"## {one}\n\n```text\n{keys_text(one)}\n```" for one in COMMANDS)]) + "\n"


def commands_page() -> str:
    """Every command with its help, its arguments and its options."""
    from typer.main import get_command

    from api.cli.main import app

    root = get_command(app)
    parts = ["# Commands", "Every command has `--help`; exit status 0: done, 2: bad input, 1: anything else."]
    return "\n\n".join([*parts, *_commands("damper-rig", root)]) + "\n"


def _commands(name: str, command: Any) -> list[str]:  # Any: typer keeps click inside or outside of itself
    """The command, or each of those below it, in alphabetical order."""
    below = getattr(command, "commands", {})
    if below:
        return [part for word in sorted(below) for part in _commands(f"{name} {word}", below[word])]
    told = (command.help or "").replace("<", "&lt;")
    rows = [_row(one) for one in command.params if getattr(one, "help", None)]
    table = "\n".join(["| argument or option | what it is |", "|---|---|", *rows])
    return [f"## {name}", told, *([table] if rows else [])]


def _row(parameter: Any) -> str:
    words = (
        ", ".join(parameter.opts) if parameter.param_type_name == "option" else (parameter.metavar or parameter.name)
    )
    text = " ".join(parameter.help.split()).replace("|", "\\|").replace("<", "&lt;")
    return f"| `{words}` | {text} |"
