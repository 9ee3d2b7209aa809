import base64
import hashlib
import re
from html.parser import HTMLParser

import pytest

from brushgs.outlets.page import html
from brushgs.outlets.page.container import write_container
from brushgs.outlets.page.html import Preview, page_html, page_script, plain_text
from tests.kit.for_each import for_each
from tests.outlets.page.paintings import contents_of, some_coat, some_strokes

HOSTILE = [
    "</script><script>alert(1)</script>",
    "</title><img src=x onerror=alert(1)>",
    "\"' onload=alert(1) x='",
    "<!-- <script>alert(1)</script>",
    "a\u2028b\u2029c\x00d\x1be\r\nf\udc80g",
    "{{script}}{{contents}}",
    "&lt;script&gt;alert(1)&lt;/script&gt;",
]
JPEG = b"\xff\xd8\xff\xe0 no picture, but it begins as one"


class Elements(HTMLParser):
    """The start tags of a page with their attributes, and the text in each element."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.tags, self.text = [], {}
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_data(self, data):
        if self.tags:
            name = self.tags[-1][0] + "#" + self.tags[-1][1].get("id", "")
            self.text[name] = self.text.get(name, "") + data

    def named(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


@for_each("name", HOSTILE)
def test_a_hostile_name_becomes_text_and_nothing_else(name):
    contents = contents_of(some_coat(some_strokes(20), name=name), title=name)
    contents.header["brushes"][0]["name"] = name
    text = page_html(write_container(contents), title=name, still=JPEG)
    plain = page_html(write_container(contents_of()), title="", still=JPEG)
    found, usual = Elements(text), Elements(plain)
    shapes = [[(tag, set(attributes)) for tag, attributes in elements.tags] for elements in (found, usual)]
    assert shapes[0] == shapes[1]
    assert found.text["title#"].strip() == plain_text(name).strip()
    assert not re.search(r"[\x00-\x09\x0b-\x1f\u2028\u2029\ud800-\udfff]", text)
    assert "<!--" not in text
    text.encode("utf-8")


def test_the_contents_are_the_last_element_and_the_policy_allows_the_one_script_alone():
    content = write_container(contents_of(some_coat(some_strokes(5))))
    text = page_html(content, title="t", still=JPEG)
    found = Elements(text)
    (script, data), (style,) = found.named("script"), found.named("style")
    assert (script, style) == ({}, {})
    assert data == {"type": "application/octet-stream", "id": "contents"}
    assert found.tags[-1] == ("script", data)
    assert base64.b64decode(found.text["script#contents"].split("<")[0].strip()) == content
    (policy,) = [meta["content"] for meta in found.named("meta") if "http-equiv" in meta]
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    assert rules["default-src"] == "'none'"
    assert "unsafe" not in policy
    assert "'self'" not in policy
    for rule, element in (("script-src", "script"), ("style-src", "style")):
        (inside,) = re.findall(rf"<{element}>(.*?)</{element}>", text, re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(inside.encode()).digest()).decode()
        assert rules[rule] == f"'sha256-{digest}'"
    (still,) = found.named("img")
    assert still["src"] == "data:image/jpeg;base64," + base64.b64encode(JPEG).decode()


def test_a_still_of_another_kind_and_a_script_that_would_end_its_element_are_refused(tmp_path, monkeypatch):
    with pytest.raises(ValueError, match="JPEG"):
        page_html(None, title="t", still=b"GIF89a")
    monkeypatch.setattr(html, "_web", lambda: tmp_path)
    for text in ("// </SCRIPT>", "'<!--'"):
        html.web_text.cache_clear()
        (tmp_path / "app.js").write_text(text)
        with pytest.raises(ValueError, match="script"):
            page_script()
    html.web_text.cache_clear()


def test_a_shader_that_includes_itself_or_nothing_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(html, "_web", lambda: tmp_path)
    html.web_text.cache_clear()
    (tmp_path / "a.glsl").write_text('#include "b.glsl"\n')
    with pytest.raises(ValueError, match=r"a\.glsl includes b\.glsl, which is missing"):
        html.shaders()
    (tmp_path / "b.glsl").write_text('#include "a.glsl"\n')
    with pytest.raises(ValueError, match=r"a\.glsl -> b\.glsl -> a\.glsl includes itself"):
        html.shaders()
    html.web_text.cache_clear()


def test_chromium_runs_the_script_of_the_page_and_no_other(browser, open_page, tmp_path, monkeypatch):
    ran = "document.getElementById('message').textContent = 'ran </b>';"
    monkeypatch.setattr(html, "page_script", lambda **kind: f"(() => {{ {ran} }})();")
    text = page_html(write_container(contents_of(some_coat(some_strokes(5)))), title="t")
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    page = open_page(tmp_path / "page.html")
    assert page.text_content("#message") == "ran </b>"
    assert page.evaluate("getComputedStyle(document.body).margin") == "0px"  # the style was taken too
    other = text.replace("</main>", "<script>window.bad = 1</script></main>")
    (tmp_path / "other.html").write_text(other, encoding="utf-8")
    tab = browser.new_page()
    tab.goto((tmp_path / "other.html").as_uri())
    assert tab.evaluate("window.bad") is None
    tab.close()


def test_a_preview_is_in_the_head_and_its_texts_are_no_markup():
    preview = Preview('a "b" <c>', "https://example.org/a.html", "a.jpg", JPEG)
    found = Elements(page_html(None, title="t", preview=preview))
    told = {one["property"]: one["content"] for one in found.named("meta") if "property" in one}
    assert told == {
        "og:type": "website",
        "og:title": "t",
        "og:description": 'a "b" <c>',
        "og:url": "https://example.org/a.html",
        "og:image": "https://example.org/a.jpg",
    }
    [icon] = found.named("link")
    assert icon["href"].startswith("data:image/jpeg;base64,")
    assert found.text["p#caption"].strip() == 'a "b" <c>'
