"""The HTTP front of a studio, on the standard library's server, with strict checks of requests.

A few routes for one user need no framework, and all rules are here: who may ask (a token, the host name, the
origin of changing requests), how much (lengths, times, connections), and that no part of a request is used as
a file name.
"""

import hmac
import ipaddress
import json
import re
import secrets
import socket
import ssl
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from tempfile import SpooledTemporaryFile
from typing import IO, Any
from urllib.parse import parse_qsl, urlsplit

from brushgs.brushes.builtin import stroke_notes
from brushgs.errors import SceneError
from brushgs.options.viewer import ServerConfig
from brushgs.outlets.studio.overpainting import read_stroke
from brushgs.outlets.studio.settings import (
    read_film,
    read_json,
    read_moment,
    read_part,
    read_settings,
    read_shot,
)
from brushgs.outlets.studio.studio import Studio

MAX_UPLOAD = 16 << 20  # bytes of a dropped picture
MAX_SCENE = 512 << 20  # bytes of a dropped scene
MAX_JSON = 1 << 18  # 500 cameras take 200 kB
MAX_CONNECTIONS = 48  # of those who have the token, and of those who have not shown it: a browser keeps six
REQUEST_SECONDS = 30.0  # for one request: uploads come from this machine
STATE_SECONDS = 20.0  # longest wait of a request for the next state
READ_BYTES = 1 << 16
LIMITS = {"/file": MAX_UPLOAD, "/scene": MAX_SCENE}  # of what is sent, bytes; else MAX_JSON

# Replies other than the page must not run or render anything.
PLAIN_POLICY = "default-src 'none'; frame-ancestors 'none'"
PAGE_POLICY = "frame-ancestors 'none'; base-uri 'none'; form-action 'none'; object-src 'none'"
HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "X-Frame-Options": "DENY",
}


class RefusedError(Exception):
    """A refused request, with status and sentence."""

    def __init__(self, status: HTTPStatus, sentence: str) -> None:
        super().__init__(sentence)
        self.status = status


@dataclass(frozen=True)
class Reply:
    """The reply to a request."""

    content: bytes
    kind: str = "application/json"
    headers: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, value: Mapping[str, Any]) -> "Reply":
        """A reply of JSON."""
        return cls(json.dumps(value, allow_nan=False).encode())


class StudioServer(ThreadingHTTPServer):
    """The server of one studio.

    Args:
        studio: that it serves.
        config: where.

    Raises:
        OSError: if the address cannot be used.
        SceneError: if the certificate or its key cannot.
    """

    daemon_threads = True
    block_on_close = False  # keep-alive connections would delay the end
    allow_reuse_address = sys.platform != "win32"
    request_queue_size = 16

    def __init__(self, studio: Studio, config: ServerConfig) -> None:
        self.studio, self.config = studio, config
        self.token = secrets.token_urlsafe(32)
        self.tls = None if config.certificate is None else _tls(config)
        self._deadlines: dict[socket.socket, tuple[float, socket.socket]] = {}
        self._known: set[socket.socket] = set()  # connections that have shown the token
        self._lock = threading.Lock()
        try:
            super().__init__((config.host, config.port), StudioHandler)
        except OSError as error:
            cure = "take another --port, or none for a free one" if config.port else "take another --host"
            reason = error.strerror or error
            raise SceneError(f"{config.host}:{config.port}", f"cannot be served ({reason}); {cure}") from None
        self.port = int(self.server_address[1])
        self.cookie = f"brushgs-{self.port}"  # cookies are shared by all ports of a host

    @property
    def scheme(self) -> str:
        """The protocol, "http" or "https"."""
        return "http" if self.tls is None else "https"

    def address(self, host: str | None = None) -> str:
        """The address that opens the page, with its token."""
        name = host or ("127.0.0.1" if self.config.host == "0.0.0.0" else self.config.host)
        return f"{self.scheme}://{name}:{self.port}/?token={self.token}"

    def is_own_host(self, text: str) -> bool:
        """Whether the header Host names this server (against DNS rebinding).

        Numeric addresses cannot be rebound, so any is accepted if other machines are served.
        """
        default = 80 if self.tls is None else 443
        match = re.fullmatch(r"([A-Za-z0-9.-]{1,253}|\[[0-9A-Fa-f:.]{2,45}\])(?::([0-9]{1,5}))?", text)
        if match is None or int(match[2] or default) != self.port:
            return False
        name = match[1].lower()
        if name in ("localhost", "127.0.0.1", self.config.host.lower()):
            return True
        if self.config.is_local:
            return False
        machine = socket.gethostname().lower()
        return name in (machine, f"{machine}.local") or _is_address(name.strip("[]"))

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer a connection in a thread of its own; of too many without the token the oldest is closed."""
        with self._lock:
            unknown = [one for one in self._deadlines if one not in self._known]
            oldest = self._deadlines[unknown[0]][1] if len(unknown) >= MAX_CONNECTIONS else None
            if oldest is not None:
                del self._deadlines[unknown[0]]
            self._deadlines[request] = time.monotonic() + REQUEST_SECONDS, request
        if oldest is not None:
            with suppress(OSError):
                socket.socket.shutdown(oldest, socket.SHUT_RD)
        super().process_request(request, client_address)

    def know(self, request: socket.socket) -> bool:
        """Count a connection that has shown the token; False if there are too many of these."""
        with self._lock:
            if request not in self._known and len(self._known) >= MAX_CONNECTIONS:
                return False
            self._known.add(request)
        return True

    def shutdown_request(self, request: Any) -> None:
        """Close a connection."""
        with self._lock:
            self._deadlines.pop(request, None)
            self._known.discard(request)
        super().shutdown_request(request)

    def begin(self, request: socket.socket, current: socket.socket, seconds: float) -> None:
        """Set the time limit for a connection's next request; infinity during the server's turn.

        Args:
            request: the connection as it was accepted.
            current: the same, or its TLS wrapper.
            seconds: from now on.
        """
        with self._lock:
            if request in self._deadlines:
                self._deadlines[request] = time.monotonic() + seconds, current

    def service_actions(self) -> None:
        """Close connections that send too slowly; called twice a second."""
        now = time.monotonic()
        with self._lock:
            late = [current for until, current in self._deadlines.values() if until < now]
        for request in late:
            with suppress(OSError):
                # Only shut down reading: its own thread answers and closes. TLS objects must not be used by
                # two threads.
                socket.socket.shutdown(request, socket.SHUT_RD)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore broken connections."""


class StudioHandler(BaseHTTPRequestHandler):
    """Answers the requests of one connection."""

    protocol_version = "HTTP/1.1"
    server_version, sys_version = "brushgs", ""
    error_content_type = "application/json"
    timeout = REQUEST_SECONDS
    server: StudioServer

    def setup(self) -> None:
        """Start a connection; the TLS handshake happens here, in its own thread."""
        self.plain_request = self.request
        if self.server.tls is not None:
            self.request.settimeout(self.timeout)
            self.request = self.server.tls.wrap_socket(
                self.plain_request, server_side=True, do_handshake_on_connect=False
            )
            self.server.begin(self.plain_request, self.request, REQUEST_SECONDS)
            self.request.do_handshake()
        super().setup()

    def finish(self) -> None:
        """End a connection."""
        try:
            super().finish()
        finally:
            if self.request is not self.plain_request:
                self.request.close()

    def handle_one_request(self) -> None:
        """Wait for a request, and answer it."""
        self.server.begin(self.plain_request, self.request, REQUEST_SECONDS)
        super().handle_one_request()

    def do_GET(self) -> None:
        """Answer a request for something."""
        self._answer()

    def do_POST(self) -> None:
        """Answer a request to do something."""
        self._answer()

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing: the terminal shows written files."""

    def handle_expect_100(self) -> bool:
        """Answer `Expect: 100-continue` only after all checks; browsers never send it."""
        self.send_error(HTTPStatus.EXPECTATION_FAILED)
        return False

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Refuse a request that `http.server` could not read."""
        known = {501: HTTPStatus.METHOD_NOT_ALLOWED, 505: HTTPStatus.BAD_REQUEST}
        status = known.get(code, HTTPStatus(code))
        self._send(status, Reply.of({"error": status.phrase}), closes=True)

    def _answer(self) -> None:
        """Check a request, do what it asks, and answer."""
        try:
            reply = self._reply()
        except RefusedError as refused:
            self._send(refused.status, Reply.of({"error": str(refused)}), closes=True)
        except TimeoutError:
            sentence = "the request took too long"
            self._send(HTTPStatus.REQUEST_TIMEOUT, Reply.of({"error": sentence}), closes=True)
        except ValueError as error:  # invalid request data
            reply = Reply.of({"error": " ".join(str(error).split())})
            self._send(HTTPStatus.BAD_REQUEST, reply, closes=True)  # its body may not have been read
        except OSError as error:
            sentence = error.strerror or "the file cannot be read"
            self._send(HTTPStatus.INTERNAL_SERVER_ERROR, Reply.of({"error": sentence}), closes=True)
        else:
            self._send(HTTPStatus.OK, reply)

    def _reply(self) -> Reply:
        url = urlsplit(self.path) if self.path.startswith("/") and len(self.path) < 2048 else None
        if url is None:
            raise RefusedError(HTTPStatus.BAD_REQUEST, "the address is not one of this server")
        hosts = self.headers.get_all("Host", [])
        if len(hosts) != 1 or not self.server.is_own_host(hosts[0]):
            raise RefusedError(HTTPStatus.FORBIDDEN, "open the address that `brushgs view` printed")
        query = dict(parse_qsl(url.query, True, bool(url.query), max_num_fields=8))
        if not self._has_token(query.get("token") if url.path == "/" else None):
            sentence = "open the address that `brushgs view` printed, with its token"
            raise RefusedError(HTTPStatus.FORBIDDEN, sentence)
        if not self.server.know(self.plain_request):
            sentence = "too many connections are open: close other tabs of this page, and load it again"
            raise RefusedError(HTTPStatus.SERVICE_UNAVAILABLE, sentence)
        methods = {method for method, path in ROUTES if path == url.path}
        if not methods:
            raise RefusedError(HTTPStatus.NOT_FOUND, "there is nothing of that name")
        if self.command not in methods:
            raise RefusedError(HTTPStatus.METHOD_NOT_ALLOWED, f"only {', '.join(methods)}")
        if self.command == "POST":
            self._check_origin(hosts[0])
        route = ROUTES[self.command, url.path]
        with SpooledTemporaryFile(MAX_UPLOAD) as body:
            self._receive(LIMITS.get(url.path, MAX_JSON), body)
            body.seek(0)
            self.server.begin(self.plain_request, self.request, float("inf"))
            return route(self, query, body)

    def _has_token(self, given: str | None) -> bool:
        """Whether a request has the token, by cookie or, the first time, by address."""
        if given is None:
            try:
                cookies = SimpleCookie("; ".join(self.headers.get_all("Cookie", [])))
            except CookieError:
                return False
            morsel = cookies.get(self.server.cookie)
            given = "" if morsel is None else morsel.value
        return hmac.compare_digest(given.encode(errors="replace"), self.server.token.encode())

    def _check_origin(self, host: str) -> None:
        """Refuse cross-origin requests."""
        origins = self.headers.get_all("Origin", [])
        if origins != [f"{self.server.scheme}://{host}"]:
            raise RefusedError(HTTPStatus.FORBIDDEN, "only the page itself may ask for that")

    def _receive(self, most: int, content: IO[bytes]) -> None:
        """Write the body of a request to a file, at most `most` bytes; none for GET."""
        lengths = self.headers.get_all("Content-Length", [])
        if "Transfer-Encoding" in self.headers:
            raise RefusedError(HTTPStatus.LENGTH_REQUIRED, "say the length, in place of chunks")
        if self.command != "POST":
            if lengths not in ([], ["0"]):
                raise RefusedError(HTTPStatus.BAD_REQUEST, "this request holds nothing")
            return
        if not lengths:
            raise RefusedError(HTTPStatus.LENGTH_REQUIRED, "say the length of what is sent")
        if len(lengths) > 1 or not re.fullmatch(r"[0-9]{1,18}", lengths[0]):
            raise RefusedError(HTTPStatus.BAD_REQUEST, "the length must be a number of bytes")
        length = int(lengths[0])
        if length > most:
            sentence = f"at most {most / (1 << 20):g} MiB may be sent"
            raise RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, sentence)
        while (left := length - content.tell()) > 0:
            piece = self.rfile.read1(min(left, READ_BYTES))
            if not piece:
                raise RefusedError(HTTPStatus.REQUEST_TIMEOUT, "less was sent than was said")
            content.write(piece)

    def _send(self, status: HTTPStatus, reply: Reply, *, closes: bool = False) -> None:
        try:
            self.send_response(status)
            for name, value in {**HEADERS, "Content-Security-Policy": PLAIN_POLICY, **reply.headers}.items():
                self.send_header(name, value)
            self.send_header("Content-Type", reply.kind)
            self.send_header("Content-Length", str(len(reply.content)))
            if closes:  # the rest of its data is not a request
                self.send_header("Connection", "close")
                self.close_connection = True
            self.end_headers()
            if self.command != "HEAD":
                self.wfile.write(reply.content)
        except OSError:  # the browser closed the connection
            self.close_connection = True

    def page(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """The page; sets the cookie with the token."""
        secure = "; Secure" if self.server.tls is not None else ""
        cookie = f"{self.server.cookie}={self.server.token}; Path=/; HttpOnly; SameSite=Strict{secure}"
        headers = {"Set-Cookie": cookie, "Content-Security-Policy": PAGE_POLICY}
        return Reply(self.server.studio.page().encode(), "text/html; charset=utf-8", headers)

    def state(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """The state, as soon as it differs from the given number."""
        known = query.get("known", "0")
        if not re.fullmatch(r"[0-9]{1,15}", known):
            raise ValueError("known must be the number of a state")
        return Reply.of(self.server.studio.state(int(known), STATE_SECONDS))

    def choices(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """The choices of the page's controls."""
        return Reply.of(self.server.studio.choices())

    def contents(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """The painting."""
        version, content = self.server.studio.contents()
        return Reply(content, "application/octet-stream", {"X-Version": str(version)})

    def settings(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """Change the painting."""
        studio = self.server.studio
        settings = read_settings(read_json(body.read()), studio.session.known)
        return Reply.of({"number": studio.change(settings)})

    def moment(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """Keep the moment of a moving scene that is shown."""
        self.server.studio.keep_moment(read_moment(read_json(body.read())))
        return Reply.of({})

    def file(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """Store a dropped picture."""
        return Reply.of({"id": self.server.studio.add_file(_name_in(query) or "picture", body.read())})

    def scene(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """Open a dropped scene."""
        return Reply.of({"id": self.server.studio.add_scene(_name_in(query) or "scene", body)})

    def open_scene(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """Open a known scene."""
        return Reply.of({"number": self.server.studio.open_scene(query.get("id", ""))})

    def render(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """Start painting a picture."""
        return Reply.of({"id": self.server.studio.shoot(read_shot(read_json(body.read())))})

    def video(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """Start painting a video."""
        return Reply.of({"id": self.server.studio.film(read_film(read_json(body.read())))})

    def stroke(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """Paint over the scene."""
        studio = self.server.studio
        stroke = read_stroke(read_json(body.read()), [note.name for note in stroke_notes()])
        return Reply.of({"number": studio.paint_over(stroke)})

    def undo(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """Take the last stroke back."""
        return Reply.of({"number": self.server.studio.step_marks(-1)})

    def redo(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """Paint the stroke again that was taken back."""
        return Reply.of({"number": self.server.studio.step_marks(1)})

    def where(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """Find the strokes in a part of the scene."""
        return Reply.of(self.server.studio.find(read_part(read_json(body.read()))))

    def stop(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """Stop a picture or a video."""
        return Reply.of({"stopped": self.server.studio.stop(query.get("id", ""))})

    def icon(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """An empty favicon, which browsers request."""
        return Reply(b"", "image/png")

    def output(self, query: Mapping[str, str], body: IO[bytes]) -> Reply:
        """A picture or a video that was written."""
        path = self.server.studio.output(query.get("id", ""))
        if path is None:
            raise RefusedError(HTTPStatus.NOT_FOUND, "there is no such picture or video")
        kind = {".png": "image/png", ".mp4": "video/mp4"}[path.suffix]
        return Reply(path.read_bytes(), kind)


Route = Callable[[StudioHandler, Mapping[str, str], IO[bytes]], Reply]
ROUTES: Mapping[tuple[str, str], Route] = {
    ("GET", "/"): StudioHandler.page,
    ("GET", "/favicon.ico"): StudioHandler.icon,
    ("GET", "/state"): StudioHandler.state,
    ("GET", "/choices"): StudioHandler.choices,
    ("GET", "/contents"): StudioHandler.contents,
    ("GET", "/output"): StudioHandler.output,
    ("POST", "/settings"): StudioHandler.settings,
    ("POST", "/moment"): StudioHandler.moment,
    ("POST", "/file"): StudioHandler.file,
    ("POST", "/scene"): StudioHandler.scene,
    ("POST", "/open"): StudioHandler.open_scene,
    ("POST", "/render"): StudioHandler.render,
    ("POST", "/video"): StudioHandler.video,
    ("POST", "/where"): StudioHandler.where,
    ("POST", "/stroke"): StudioHandler.stroke,
    ("POST", "/undo"): StudioHandler.undo,
    ("POST", "/redo"): StudioHandler.redo,
    ("POST", "/stop"): StudioHandler.stop,
}


def _name_in(query: Mapping[str, str]) -> str:
    """The name of a dropped file, for people."""
    return "".join(letter for letter in query.get("name", "") if letter.isprintable())[:200]


def _is_address(text: str) -> bool:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True


def _tls(config: ServerConfig) -> ssl.SSLContext:
    """The context of https. Raises SceneError if the files are no certificate and its key."""
    from brushgs.formats.files import check_plain

    assert config.certificate is not None
    assert config.key is not None
    check_plain(config.certificate, "certificate")
    check_plain(config.key, "key")
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(config.certificate, config.key, password="")
    except (OSError, ValueError) as error:
        reason = getattr(error, "reason", None) or getattr(error, "strerror", None) or error
        sentence = f"is no certificate in PEM with its key {config.key} ({reason}); give both files"
        raise SceneError(config.certificate, sentence) from None
    return context
