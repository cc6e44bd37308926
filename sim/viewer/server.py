"""A quiet server of viser's for this machine only, from the extra `view`."""

from __future__ import annotations

import io
import socket
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING

from models.errors import InputError

if TYPE_CHECKING:
    import viser

HOST = "127.0.0.1"
"""Who can reach this machine from outside must not push its robot."""


def check_viser() -> None:
    """Check that viser is there.

    Raises:
        InputError: if it is not; names the extra.
    """
    if find_spec("viser") is None:
        raise InputError(
            "viewing in 3-D needs viser, which is not installed; pip install 'okiagari[view]', or make extras"
        )


@contextmanager
def served(port: int = 0) -> Iterator[viser.ViserServer]:
    """A server that runs while the block does.

    Args:
        port: where it listens; 0 for any that is free.

    Raises:
        InputError: if viser is not installed, or the port is taken or not ours to take.
    """
    check_viser()
    import viser

    check_free(port)
    # Viser announces itself on stdout, which is ours; tracebacks and logs go elsewhere.
    with redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=HOST, port=port, label="Okiagari", verbose=False)
    try:
        yield server
    finally:
        with redirect_stdout(io.StringIO()):
            server.stop()


def check_free(port: int) -> None:
    """Check that a port can be listened at; viser would take the next one instead.

    Raises:
        InputError: if it is taken or not ours to take.
    """
    with socket.socket() as trial:
        with suppress(OSError):
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((HOST, port))
        except OSError as error:
            raise InputError(f"--port: {port} cannot be used: {error.strerror}; choose another") from None
