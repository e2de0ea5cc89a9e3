"""``exactcreep scenes``: the built-in scenes."""

from __future__ import annotations

from typing import Annotated

import typer

import exactcreep
from exactcreep.commands.answer import as_json
from exactcreep.commands.options import Json, command, option


@command()
def scenes(
    json: Json = False,
    show: Annotated[str | None, option("NAME", "Print the TOML text of this scene.")] = None,
) -> None:
    """List the built-in scenes, or print one as a start for your own.

    A scene is a TOML file: a chain, its drive, what is recorded, and what varies.

    Example:

        exactcreep scenes --show chain-jumps > my-scene.toml
    """
    from exactcreep.scene import builtin_scenes

    texts = builtin_scenes()
    if show is not None:
        if show not in texts:
            raise exactcreep.InputError("show", show, "must be one of " + ", ".join(texts))
        typer.echo(texts[show], nl=False)
        return
    found = [exactcreep.load_scene(name) for name in texts]
    if json:
        listed = [
            {"name": scene.name, "title": scene.title, "members": len(scene.settings())}
            for scene in found
        ]
        typer.echo(as_json({"scenes": listed}))
        return
    width = max(len(scene.name) for scene in found)
    for scene in found:
        typer.echo(f"{scene.name:<{width}}  {scene.title}")
