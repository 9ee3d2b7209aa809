"""`brushgs view`: paint a scene, serve its page, and open the browser, until Ctrl-C."""

import tempfile
import webbrowser
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from brushgs.options.viewer import ServerConfig
from brushgs.outlets.studio.hearing import hearing_warnings
from brushgs.outlets.studio.server import StudioServer
from brushgs.outlets.studio.session import Painted, Session
from brushgs.outlets.studio.settings import Settings
from brushgs.outlets.studio.studio import Studio
from brushgs.pipeline.outputs import check_folder
from brushgs.pipeline.report import Report

SECONDS_TO_LEAVE = 10.0  # to wait for the running stage at the end


def paint_first(session: Session, report: Report) -> Painted:
    """The first painting, with the options of the command line.

    Raises:
        SceneError: if a file cannot be read, or the folder of the outputs cannot be written to.
        ValueError: if an option does not suit the scene.
    """
    check_folder(session.folder.resolve(), session.folder)
    return session.paint(Settings(), report)


def serve(
    session: Session,
    first: Painted,
    config: ServerConfig,
    *,
    say: Callable[[str], None],
    note: Callable[[str], None],
    opens_browser: bool = True,
    is_for_headset: bool = False,
    others: Sequence[Path] = (),
) -> None:
    """Serve the page until Ctrl-C.

    Args:
        session: whose painting is shown.
        first: what `paint_first` returned.
        config: where.
        say: called with the address and paths of written files.
        note: called with sentences for people.
        opens_browser: open the browser of this machine.
        is_for_headset: print how to reach the page from a headset.
        others: scenes that the page offers.

    Raises:
        SceneError: if the address or the certificate cannot be used.
        KeyboardInterrupt: at the end, after all work is abandoned.
    """
    with ExitStack() as stack:
        heard = stack.enter_context(hearing_warnings())
        uploads = stack.enter_context(tempfile.TemporaryDirectory(prefix="brushgs-"))
        studio = Studio(session, first, uploads=Path(uploads), heard=heard, say=say, others=others)
        stack.callback(studio.close, SECONDS_TO_LEAVE)
        server = stack.enter_context(StudioServer(studio, config))
        studio.hint = headset_hint(server)
        if not config.is_local:
            note(f"others who reach {config.host} and know the address with its token can use this page")
        if is_for_headset or not config.is_local:
            note(studio.hint)
        say(server.address())
        note("stop with Ctrl-C")
        if opens_browser and not webbrowser.open(server.address()):
            note("no browser could be opened; open the address")
        server.serve_forever()


def headset_hint(server: StudioServer) -> str:
    """How to reach the page from a headset: browsers allow headsets only over https or localhost."""
    if server.tls is not None:
        return f"headset: open {server.address()} in its browser"
    port = server.port
    return (
        f"headset: connect it by USB, run `adb reverse tcp:{port} tcp:{port}`, and open "
        f"{server.address('localhost')} in its browser; or serve https with --certificate and --private-key"
    )
