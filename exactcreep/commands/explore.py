"""``exactcreep explore``: a page with sliders for the parameters, on this machine alone."""

from __future__ import annotations

import webbrowser
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Annotated
from urllib.parse import parse_qsl, urlsplit

import typer

import exactcreep
from exactcreep.commands.options import command, flag, option

HOST = "127.0.0.1"
_KINDS = {"<": "text/html", "{": "application/json"}  # by how a text begins


@command()
def explore(
    port: Annotated[str, option("PORT", "Where the page is; 0: any port that is free.")] = "0",
    browser: Annotated[bool, flag("--browser/--no-browser", "Whether to open the page.")] = True,
) -> None:
    """Play with a chain in the browser: sliders for its parameters, avalanches that move.

    The page is served to this machine alone, until Ctrl-C.
    """
    from exactcreep.model.numbers import whole_number

    number = whole_number(port, "port", least=0, most=65_535)
    with page_server(number) as server:
        url = f"http://{HOST}:{server.server_address[1]}/"
        typer.echo(f"{url} (Ctrl-C ends it)")
        if browser:
            webbrowser.open(url)
        server.serve_forever()


def page_server(port: int = 0) -> ThreadingHTTPServer:
    """Return a server of the page, which a `with` block closes.

    Raises
    ------
    InputError
        If the port is taken, or not allowed.
    """
    try:
        server = ThreadingHTTPServer((HOST, port), _Visit)
    except OSError as error:
        raise exactcreep.InputError("port", port, f"cannot be used: {error.strerror}") from None
    server.daemon_threads = True  # an answer that is being computed keeps nothing alive
    return server


class _Visit(BaseHTTPRequestHandler):
    """One question of the page."""

    def reply(self) -> None:
        """Answer it."""
        from exactcreep.figures import explorer

        if (self.headers["Host"] or "").rpartition(":")[0] not in (HOST, "localhost"):
            # a page of somebody else, whose name was made to lead here
            self._answer(403, "this page is for this machine alone")
            return
        asked = urlsplit(self.path)
        given = dict(parse_qsl(asked.query, keep_blank_values=True))
        try:
            text = explorer.answer(asked.path.removeprefix("/"), given)
            self._answer(404 if text is None else 200, text or "there is no such page")
        except exactcreep.InputError as error:
            told = {"field": error.field, "sentence": str(error)}
            self._answer(400, explorer.as_text(told))
        except (BrokenPipeError, ConnectionResetError):
            pass  # the reader has gone
        except Exception as error:
            told = {"sentence": f"{type(error).__name__}: {error} (a defect)"}
            self._answer(500, explorer.as_text(told))

    do_GET = reply  # the name by which the library calls it

    def _answer(self, status: int, text: str) -> None:
        body, kind = text.encode(), _KINDS.get(text[:1], "text/plain")
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing of every request."""
