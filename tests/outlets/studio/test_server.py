"""Real HTTP: who may ask, how much, and that nothing that is sent stops the server or reaches a file."""

import http.client
import json
import re
import socket
import ssl
import subprocess
import time
from contextlib import suppress

import pytest

from brushgs.errors import SceneError
from brushgs.options.viewer import ServerConfig
from brushgs.outlets.studio import server as server_module
from brushgs.outlets.studio.server import MAX_JSON, MAX_SCENE, MAX_UPLOAD, ROUTES, StudioServer
from tests.kit.for_each import for_each
from tests.outlets.studio.conftest import SECONDS, serving


def own_headers(server, method="GET"):
    headers = {"Cookie": f"{server.cookie}={server.token}"}
    return headers | ({"Origin": f"http://127.0.0.1:{server.port}"} if method == "POST" else {})


def ask(server, method, path, body=None, **headers):
    """Status, headers and content of an answer; a header of None is left out."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=SECONDS)
    given = {name.replace("_", "-"): value for name, value in headers.items()}
    all_headers = {k: v for k, v in (own_headers(server, method) | given).items() if v is not None}
    content = json.dumps(body).encode() if isinstance(body, dict) else body
    try:
        connection.request(method, path, body=content, headers=all_headers)
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read()
    finally:
        connection.close()


def send(server, text, *, ends=True):
    """The status of the answer to raw bytes; None if the connection was closed without one."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=SECONDS) as connection:
        connection.sendall(text if isinstance(text, bytes) else text.encode())
        if ends:
            connection.shutdown(socket.SHUT_WR)
        answer = b""
        while piece := connection.recv(65536):
            answer += piece
    match = re.match(rb"HTTP/1\.1 ([0-9]{3}) ", answer)
    return None if match is None else int(match[1])


def request(server, line, *headers, body=b""):
    """A raw request with the right host, token and origin."""
    own = [f"{name}: {value}" for name, value in own_headers(server, "POST").items()]
    head = "\r\n".join([line, f"Host: 127.0.0.1:{server.port}", *own, *headers, "", ""])
    return head.encode("latin-1") + body


def is_alive(server):
    return ask(server, "GET", "/state")[0] == 200


def test_the_printed_address_opens_the_page_and_gives_the_cookie(shared):
    path = shared.address().removeprefix(f"http://127.0.0.1:{shared.port}")
    status, headers, page = ask(shared, "GET", path, Cookie=None)
    assert (status, headers["Content-Type"]) == (200, "text/html; charset=utf-8")
    cookie = f"brushgs-{shared.port}={shared.token}; Path=/; HttpOnly; SameSite=Strict"
    assert headers["Set-Cookie"] == cookie
    assert b"class Studio" in page
    assert b"connect-src data: blob: 'self'" in page
    assert shared.token.encode() not in page
    status, headers, content = ask(shared, "GET", "/contents")
    assert (status, headers["Content-Type"], headers["X-Version"]) == (200, "application/octet-stream", "1")
    assert content == shared.studio.contents()[1]
    for path in ("/", "/state", "/contents", "/nothing"):
        headers = ask(shared, "GET", path)[1]
        assert (headers["Cache-Control"], headers["X-Content-Type-Options"]) == ("no-store", "nosniff")
        assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
        assert "Python" not in headers.get("Server", "")


@for_each(("method", "path"), ROUTES)
def test_nothing_is_answered_without_the_token(shared, method, path):
    body = b"{}" if method == "POST" else None
    assert ask(shared, method, path, body, Cookie=None)[0] == 403
    for token in ("", "x", "é", "token", "0" * 43):
        assert ask(shared, method, path, body, Cookie=f"{shared.cookie}={token}".encode())[0] == 403


def test_the_token_of_an_address_must_be_right_and_is_taken_by_the_page_itself(shared):
    for token in ("", "x", "%C3%A9", "0" * 43):
        assert ask(shared, "GET", f"/?token={token}")[0] in (400, 403)  # even with the cookie
    assert ask(shared, "GET", f"/state?token={shared.token}", Cookie=None)[0] == 403


@for_each(
    "host",
    [
        "evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", "127.0.0.1:{port}x", "", " ",
        "localhost:{port}.evil", "[::1]:{port}", "0.0.0.0:{port}", "192.168.1.2:{port}", "@127.0.0.1:{port}",
        "127.0.0.1:{port}, evil.example",
    ],
)  # fmt: skip
def test_a_name_that_is_not_of_this_server_is_refused(shared, host):
    assert ask(shared, "GET", "/state", Host=host.format(port=shared.port))[0] == 403


def test_localhost_is_this_server_and_a_request_without_a_host_is_not(shared):
    assert ask(shared, "GET", "/state", Host=f"LocalHost:{shared.port}")[0] == 200
    cookie = own_headers(shared)["Cookie"]
    assert send(shared, f"GET /state HTTP/1.1\r\nCookie: {cookie}\r\n\r\n") == 403
    assert send(shared, request(shared, "GET /state HTTP/1.1", "Host: evil.example")) == 403  # two of them


ORIGINS = ["null", "http://evil.example", "https://127.0.0.1:{port}", "http://127.0.0.1"]
ORIGINS += ["http://localhost:{port}", None]


@for_each("origin", ORIGINS)
@for_each("path", [path for method, path in ROUTES if method == "POST"])
def test_what_changes_something_must_come_from_the_page(shared, path, origin):
    given = None if origin is None else origin.format(port=shared.port)
    assert ask(shared, "POST", path, b"{}", Origin=given)[0] == 403


@for_each(
    "path",
    [
        "/etc/passwd", "/../../etc/passwd", "/..%2f..%2fetc%2fpasswd", "//etc/passwd", "/output/../../a",
        "/state/", "/STATE", "/index.html", "/%00", "/live.js", "/" + "a" * 1500, "/output?id=",
        "/output?id=../../etc/passwd", "/output?id=/etc/passwd", "/output?id=" + "0" * 16, "/output?id=%00",
    ],
)  # fmt: skip
def test_no_path_is_a_file_and_an_output_is_known_by_its_id_alone(shared, path):
    status, _, content = ask(shared, "GET", path)
    assert status in (400, 404)
    assert b"root:" not in content


@for_each(
    "text",
    [
        "\x00\x01\x02\x03\r\n\r\n",
        "GET\r\n\r\n",
        "GET /state HTTP/1.1 now\r\n\r\n",
        "GET state HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        "GET /state HTTP/9.9\r\n\r\n",
        "GET /state JUNK\r\n\r\n",
        "GET /" + "a" * 70_000 + " HTTP/1.1\r\n\r\n",
        "GET /state HTTP/1.1\r\nA: " + "a" * 70_000 + "\r\n\r\n",
        "GET /state HTTP/1.1\r\n" + "A: b\r\n" * 500 + "\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",  # of TLS
        "BREW /state HTTP/1.1\r\n\r\n",
        "POST /render HTTP/1.1\r\nExpect: 100-continue\r\n\r\n",
    ],
)
def test_a_malformed_request_is_refused_and_the_server_lives(shared, text):
    status = send(shared, text)
    assert status is None or 400 <= status < 500
    assert is_alive(shared)


@for_each(
    ("headers", "body", "status"),
    [
        ([], b"", 411),
        (["Content-Length: -1"], b"", 400),
        (["Content-Length: +2"], b"{}", 400),
        (["Content-Length: two"], b"{}", 400),
        (["Content-Length: 2", "Content-Length: 3"], b"{}", 400),
        ([f"Content-Length: {10**30}"], b"", 400),
        ([f"Content-Length: {MAX_JSON + 1}"], b"", 413),
        (["Transfer-Encoding: chunked"], b"2\r\n{}\r\n0\r\n\r\n", 411),
        (["Transfer-Encoding: chunked", "Content-Length: 2"], b"{}", 411),
        (["Content-Length: 10"], b"{}", 408),  # and then an end
    ],
)
def test_what_is_sent_must_have_its_length(shared, headers, body, status):
    assert send(shared, request(shared, "POST /render HTTP/1.1", *headers, body=body)) == status
    assert is_alive(shared)


def test_too_much_another_method_and_a_question_with_contents_are_refused(shared):
    for path, most in (("/file", MAX_UPLOAD), ("/scene", MAX_SCENE)):  # before it is sent
        line = f"POST {path}?name=a.png HTTP/1.1"
        assert send(shared, request(shared, line, f"Content-Length: {most + 1}"), ends=False) == 413
    for line in ("POST /state", "GET /render", "PUT /settings", "DELETE /", "HEAD /", "OPTIONS /"):
        method, path = line.split()
        assert ask(shared, method, path, b"{}" if method == "POST" else None)[0] == 405
    assert send(shared, request(shared, "GET /state HTTP/1.1", "Content-Length: 2", body=b"{}")) == 400


NOT_TAKEN = {
    "/settings": (b"", b"[", b"\xff", {"relief": 2}, {"stroke": "/etc/passwd"}, {"paletteStrength": 0.5}),
    "/settings?a": (b"{}",),
    "/settings?" + "a=b&" * 20: (b"{}",),
    "/render": ({}, b'{"camera":' * 10_000),
    "/video": ({"kind": "turn"},),
    "/file?name=a.png": (b"no",),
    "/file?name=%2e%2e%2fa.png": (b"",),
    "/scene?name=..%2Fa.ply": (b"no scene",),
    "/open?id=..%2Fa.ply": (b"{}",),
    "/where": ({}, {"where": "mask:/etc/passwd"}, {"where": "subject", "camera": 1}),
}


@for_each("path, body", [(path, body) for path, bodies in NOT_TAKEN.items() for body in bodies])
def test_what_cannot_be_is_refused_with_a_sentence_and_not_kept(shared, path, body):
    before = shared.studio.state(), shared.studio.choices()
    status, _, content = ask(shared, "POST", path, body)
    assert status == 400
    assert len(json.loads(content)["error"]) > 10
    assert (shared.studio.state(), shared.studio.choices()) == before


def test_slow_requests_are_closed_and_others_are_served(session, tmp_path, monkeypatch):
    monkeypatch.setattr(server_module, "REQUEST_SECONDS", 0.3)
    with serving(session, tmp_path) as server:
        head = request(server, "POST /render HTTP/1.1", "Content-Length: 10", body=b"{")
        for text in (b"", b"GET /sta", b"GET /state HTTP/1.1\r\nHost: ", head):
            with socket.create_connection(("127.0.0.1", server.port), timeout=SECONDS) as connection:
                connection.sendall(text)
                start = time.monotonic()
                while connection.recv(65536):  # an answer or none, and then the end
                    pass
                assert time.monotonic() - start < SECONDS / 2
        assert is_alive(server)


def test_those_without_the_token_do_not_keep_out_those_who_have_it(session, tmp_path, monkeypatch):
    monkeypatch.setattr(server_module, "MAX_CONNECTIONS", 3)
    with serving(session, tmp_path) as server:
        address = "127.0.0.1", server.port
        held = [socket.create_connection(address, timeout=SECONDS) for _ in range(3)]
        for _ in range(4):
            assert is_alive(server)
        assert held[0].recv(1) == b""  # the oldest had to go
        for connection in held:
            connection.close()


def test_too_many_with_the_token_are_told_so_and_come_back(session, tmp_path, monkeypatch):
    monkeypatch.setattr(server_module, "MAX_CONNECTIONS", 3)
    with serving(session, tmp_path) as server:
        open_ones = [http.client.HTTPConnection("127.0.0.1", server.port, timeout=SECONDS) for _ in range(3)]
        for connection in open_ones:
            connection.request("GET", "/choices", headers=own_headers(server, "GET"))
            assert connection.getresponse().read()
        status, _, content = ask(server, "GET", "/state")
        assert status == 503
        assert json.loads(content)["error"].startswith("too many connections are open: close other tabs")
        for connection in open_ones:
            connection.close()
        until = time.monotonic() + SECONDS
        while not is_alive(server):
            assert time.monotonic() < until
            time.sleep(0.01)


def test_a_server_for_others_takes_numbers_and_no_foreign_names(shared):
    with StudioServer(shared.studio, ServerConfig(host="0.0.0.0")) as server:
        port = server.port
        for name in ("192.168.1.2", "[fe80::1]", "localhost", socket.gethostname()):
            assert server.is_own_host(f"{name}:{port}")
        assert not server.is_own_host(f"evil.example:{port}")
        assert not server.is_own_host("192.168.1.2")
        assert server.address().startswith(f"http://127.0.0.1:{port}/?token=")


def test_an_address_that_is_taken_is_refused(shared):
    with pytest.raises(SceneError, match=r"127.0.0.1:[0-9]+: cannot be served .*take another --port"):
        StudioServer(shared.studio, ServerConfig(port=shared.port))
    with pytest.raises(SceneError, match=r"192.0.2.1:0: cannot be served .*take another --host"):
        StudioServer(shared.studio, ServerConfig(host="192.0.2.1"))


@pytest.fixture(scope="module")
def certificate(tmp_path_factory):
    """A certificate and its key, made by openssl."""
    folder = tmp_path_factory.mktemp("certificate")
    files = folder / "own.crt", folder / "own.key"
    words = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2"]
    words += ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"]
    words += ["-out", files[0], "-keyout", files[1]]
    try:
        subprocess.run(words, check=True, capture_output=True)
    except FileNotFoundError:
        pytest.skip("openssl is not installed")
    return files


def test_https_with_a_certificate_of_ones_own_and_no_other_file(session, tmp_path, certificate):
    config = ServerConfig(certificate=certificate[0], key=certificate[1])
    with serving(session, tmp_path, config) as server:
        with socket.create_connection(("127.0.0.1", server.port), timeout=SECONDS) as plain:
            plain.sendall(b"GET / HTTP/1.1\r\n\r\n")
            with suppress(ConnectionError):
                assert b"HTTP" not in plain.recv(65536)
        context = ssl.create_default_context(cafile=certificate[0])
        connection = http.client.HTTPSConnection("localhost", server.port, context=context, timeout=SECONDS)
        connection.request("GET", f"/?token={server.token}")
        answer = connection.getresponse()
        assert answer.status == 200
        assert answer.headers["Set-Cookie"].endswith("; Secure")
        connection.close()
        assert server.address().startswith("https://")

    own = tmp_path / "a.pem"
    for content, its_key in (
        (None, certificate[1]),
        ("no certificate", certificate[1]),
        (certificate[0].read_text(), own),  # another key
    ):
        if content is not None:
            own.write_text(content)
        with pytest.raises(SceneError, match=r"a\.pem: (there is no such certificate|is no certificate in)"):
            StudioServer(server.studio, ServerConfig(certificate=own, key=its_key))
