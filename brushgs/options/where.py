"""A part of a scene as text: terms such as "subject" or "sphere:0,0,1,0.5", with `and`, `or`, `not`, ( ).

`not` binds tighter than `and`, and `and` tighter than `or`. A term ends before ` and `, ` or ` or a
parenthesis, so words and file names may contain spaces; anything else needs quotes.
"""

import os
import re
from collections.abc import Iterator
from math import inf
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from brushgs.options.table import Options, Struct, option, share
from brushgs.options.where_terms import FORMS, Mask, Term, Words, parse_term

MAX_DEPTH = 50  # nesting: foreign text must not exhaust the stack
MAX_LENGTH = 20_000  # characters
MAX_SOFT = 2.0  # edge width relative to the subject's size: a wider edge is no edge
CLIP_VARIABLE = "BRUSHGS_CLIP"  # environment variable: default folder of the CLIP model
_OPERATOR = re.compile(r"(and|or|not)(?=[\s()]|$)", re.IGNORECASE)
_QUOTE = re.compile(r'"(?:[^"]|"")*"|\'(?:[^\']|\'\')*\'')


class Where(Struct, frozen=True):
    """A part of a scene: a term, or a combination of parts.

    "and" and "or" combine two or more parts, "not" one; "term" has none, see `brushgs.options.where_terms`.

    Raises:
        ValueError: if the number of parts is wrong.
    """

    operator: Literal["and", "or", "not", "term"]
    parts: "tuple[Where, ...]" = ()
    term: Term | None = None

    def __post_init__(self) -> None:
        least, most = {"and": (2, inf), "or": (2, inf), "not": (1, 1), "term": (0, 0)}[self.operator]
        if not least <= len(self.parts) <= most or (self.term is None) == (self.operator == "term"):
            raise ValueError(f"where: {self.operator!r} does not combine {len(self.parts)} parts")

    @classmethod
    def of(cls, term: Term) -> "Where":
        """A single term."""
        return cls("term", term=term)

    @classmethod
    def parse(cls, text: str) -> "Where":
        """Parse a text such as "subject and not sphere:0,0,1,0.5".

        Raises:
            ValueError: if it is invalid; the sentence quotes the fault and says what is expected.
        """
        if len(text) > MAX_LENGTH:
            raise ValueError(f"where must be at most {MAX_LENGTH:,} characters, got {len(text):,}")
        return _Parser(_tokens(text), text).whole()

    def terms(self) -> Iterator[Term]:
        """Its terms, from left to right."""
        if self.term is not None:
            yield self.term
        for part in self.parts:
            yield from part.terms()

    @property
    def masks(self) -> tuple[Path, ...]:
        """Files and folders of masks."""
        return tuple(dict.fromkeys(term.path for term in self.terms() if isinstance(term, Mask)))

    @property
    def files(self) -> tuple[Path, ...]:
        """Files that outputs must not replace: masks, and the pictures in their folders."""
        return tuple(file for path in self.masks for file in (path, *_pictures_in(path)))

    @property
    def texts(self) -> tuple[str, ...]:
        """The words of terms `text:`."""
        return tuple(dict.fromkeys(term.words for term in self.terms() if isinstance(term, Words)))

    @property
    def needs_subject(self) -> bool:
        """Whether it depends on the first view of the scene: its subject or up axis."""
        return any(term.needs_subject for term in self.terms())

    @property
    def needs_cameras(self) -> bool:
        """Whether masks need cameras."""
        return bool(self.masks)

    def __str__(self) -> str:
        if self.operator == "term":
            return str(self.term)
        if self.operator == "not":
            return f"not {self.parts[0]._inner()}"
        return f" {self.operator} ".join(part._inner() for part in self.parts)

    def _inner(self) -> str:
        """Text as part of a combination: in parentheses if itself combined."""
        return f"({self})" if self.operator in ("and", "or") else str(self)


class WhereConfig(Options, frozen=True):
    """Limits a command to a part of the scene.

    Raises:
        ValueError: if the edge is too wide, or a term lacks its cameras or model.
    """

    GROUP: ClassVar = "where"
    # fmt: off
    expression: Annotated[Where, option("part of the scene: subject, surroundings, box:x0,y0,z0,x1,y1,z1, "
        "sphere:x,y,z,radius, half:nx,ny,nz,d (where n.x >= d), color:#rrggbb,distance, height:low..high "
        "above the ground (world units, or % of the subject's), part:N (N-th largest connected one) or "
        "part:x,y,z (the nearest), mask:FILE|FOLDER (painted pictures, white inside), text:words (needs "
        "--text-model); combined by and, or, not, ( ) #mask #region #select #crop #part", flag="--where",
        default="all", metavar="EXPR", read=Where.parse)]
    soft: Annotated[float, share("width of the edge as a share of the subject's size; 0 is hard #feather",
        flag="--where-soft", le=MAX_SOFT)] = 0.0
    camera_file: Annotated[Path | None, option("cameras of the masks, matched by picture name or order: "
        "{cameras}; by default camera files beside the scene give {beside}; 'none' ignores these", default="",
        metavar="FILE|none", action="camera file")] = None
    clip: Annotated[Path | None, option("folder of your CLIP model for text:words, with config.json, "
        "model.safetensors and tokenizer.json as saved by transformers (extra text)",
        flag="--text-model",
        default=f"the environment's {CLIP_VARIABLE}", metavar="FOLDER")] = None
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.expression.needs_cameras and self.camera_file is None:
            raise ValueError(
                f"where has mask:{self.expression.masks[0]}, which needs --camera-file, the cameras that the "
                "masks were painted from"
            )
        if self.expression.texts and clip_folder(self.clip) is None:
            raise ValueError(
                f"where has text:{self.expression.texts[0]}, which needs --text-model FOLDER, a CLIP model "
                f"of yours (or {CLIP_VARIABLE} in the environment); brushgs has none and downloads none"
            )

    def __str__(self) -> str:
        return f"{self.expression}, soft {self.soft:g}" if self.soft else str(self.expression)

    @property
    def files(self) -> tuple[Path, ...]:
        """Files that outputs must not replace."""
        return (*self.expression.files, *(() if self.camera_file is None else (self.camera_file,)))

    @property
    def needs_first_view(self) -> bool:
        """Whether it depends on the first view of the scene, as a soft edge does (subject's size)."""
        return self.expression.needs_subject or self.soft > 0


def clip_folder(named: Path | None) -> Path | None:
    """The folder of the CLIP model: `named`, else that of the environment, or None."""
    told = os.environ.get(CLIP_VARIABLE)
    return named or (Path(told) if told else None)


def _pictures_in(path: Path) -> tuple[Path, ...]:
    try:
        return tuple(sorted(path.iterdir()))
    except (OSError, ValueError):  # a file, or missing: reading it reports that
        return ()


class _Token(Struct, frozen=True):
    kind: Literal["(", ")", "and", "or", "not", "term"]
    text: str


def _tokens(text: str) -> list[_Token]:
    tokens, at = [], 0
    while at < len(text):
        if text[at].isspace():
            at += 1
        elif text[at] in "()":
            tokens.append(_Token("(" if text[at] == "(" else ")", text[at]))
            at += 1
        elif match := _OPERATOR.match(text, at):
            word = match[0].lower()
            tokens.append(_Token("and" if word == "and" else "or" if word == "or" else "not", match[0]))
            at = match.end()
        else:
            end = _end_of_term(text, at)
            tokens.append(_Token("term", text[at:end].strip()))
            at = end
    return tokens


def _end_of_term(text: str, start: int) -> int:
    """Where a term ends: before ` and `, ` or `, or a parenthesis that is not in quotes."""
    at = start
    while at < len(text) and text[at] not in "()":
        if text[at] in "\"'" and text[start:at].rstrip().endswith(":"):  # an apostrophe in words is no quote
            match = _QUOTE.match(text, at)
            if match is None:
                raise ValueError(f"where must close its quotes, got {text[start:][:60]!r}")
            at = match.end()
        elif text[at].isspace() and (match := _OPERATOR.match(text, at + 1)) and match[0].lower() != "not":
            break
        else:
            at += 1
    return at


class _Parser:
    """Recursive descent over the tokens of one text."""

    def __init__(self, tokens: list[_Token], text: str) -> None:
        self._tokens, self._text, self._at = tokens, text, 0

    def whole(self) -> Where:
        if not self._tokens:
            raise ValueError(f"where must have a term, {', '.join(FORMS)}, got {self._text!r}")
        found = self._either(0)
        if self._at < len(self._tokens):
            raise self._unexpected("'and' or 'or'")
        return found

    def _next(self) -> str | None:
        return self._tokens[self._at].kind if self._at < len(self._tokens) else None

    def _unexpected(self, wanted: str) -> ValueError:
        before = " ".join(token.text for token in self._tokens[: self._at])
        token = self._tokens[self._at].text if self._at < len(self._tokens) else None
        got = "its end" if token is None else repr(token[:60])
        place = f"after {before[-60:]!r}" if before else "at its beginning"
        cure = "; put names with parentheses in quotes" if token in ("(", ")") else ""
        return ValueError(f"where must have {wanted} {place}, got {got}{cure}")

    def _either(self, depth: int) -> Where:
        return self._joined("or", depth)

    def _joined(self, operator: Literal["and", "or"], depth: int) -> Where:
        parts: list[Where] = []
        while not parts or self._next() == operator:
            self._at += bool(parts)
            parts.append(self._joined("and", depth) if operator == "or" else self._negated(depth))
        return parts[0] if len(parts) == 1 else Where(operator, tuple(parts))

    def _negated(self, depth: int) -> Where:
        if depth > MAX_DEPTH:
            raise ValueError(f"where must nest at most {MAX_DEPTH} deep, got more")
        kind = self._next()
        if kind == "term":
            self._at += 1
            return Where.of(parse_term(self._tokens[self._at - 1].text))
        if kind == "not":
            self._at += 1
            return Where("not", (self._negated(depth + 1),))
        if kind != "(":
            raise self._unexpected("a term")
        self._at += 1
        found = self._either(depth + 1)
        if self._next() != ")":
            raise self._unexpected("')'")
        self._at += 1
        return found
