// A field of the studio that shows a part of the scene which is typed, and changes no stroke.

const FORMS = [
  "subject", "surroundings", "height:low..high", "sphere:x,y,z,radius", "box:x0,y0,z0,x1,y1,z1",
  "half:nx,ny,nz,d", "color:#rrggbb,distance", "part:1",
];
const HINT = `${FORMS.join(", ")}; with and, or, not and parentheses`;

/** The field; `element` is to be put into the panel. */
class WhereField {
  /** @param {function(string): Promise<object>} find asks the server: see `Studio.find` in studio.py */
  constructor(app, find) {
    this._app = app;
    this._find = find;
    this._asked = 0; // questions so far: only the last answer counts
    this._part = null; // that it highlights
    this._text = "";
    this._words = element("p", { id: "whereWords", className: "note", role: "status" }, HINT);
    this._input = element("input", {
      type: "text", name: "where", maxLength: 2000, spellcheck: false, autocomplete: "off",
      placeholder: "subject and height:20%..", "aria-describedby": "whereWords",
    });
    const label = element("label", { className: "text" }, element("span", {}, "Show where"), this._input);
    this.element = element("div", {}, label, this._words);
    this._input.addEventListener("change", () => this.show(this._input.value));
    this._input.addEventListener("keydown", ({ key }) => {
      if (key === "Escape") this.show("");
    });
  }

  /** Highlight a part, as text; "" for none. Never throws: what is wrong with it is said below the field. */
  async show(text) {
    const asked = ++this._asked;
    this._text = this._input.value = text.trim();
    if (this._text === "") {
      this._let("", HINT);
      return;
    }
    this._say("Looking …");
    try {
      const { num, total, columns } = await this._find(this._text);
      if (asked !== this._asked) return;
      if (num === 0) {
        this._let("none", "No stroke lies there");
        return;
      }
      this._part = { columns: columns.map(bytesOfBase64), ground: 0, region: null, name: this._text };
      this._app.highlight(this._part);
      this._say(`${num.toLocaleString("en")} of ${total.toLocaleString("en")} strokes`);
    } catch (error) {
      if (asked === this._asked) this._let("error", error.message);
    }
  }

  /** The painting is another one: its strokes are looked for anew. */
  again() {
    this._part = null; // its columns are those of other strokes
    if (this._text) this.show(this._text);
  }

  /** Highlight nothing more, and say why. */
  _let(reason, words) {
    if (this._part && this._app.look.highlight === this._part) this._app.highlight(null);
    this._part = null;
    this._say(words, reason === "error");
  }

  _say(words, isError = false) {
    this._words.textContent = words;
    this._words.classList.toggle("is-error", isError);
    this._input.setAttribute("aria-invalid", String(isError));
    if (document.activeElement === this._input) this._words.scrollIntoView({ block: "nearest" });
  }
}
