// Fields of the studio: elements with labels that also screen readers read.

/** An element with properties, attributes ("aria-label", "for" and "role" among them) and children. */
function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.includes("-") || name === "for" || name === "role") made.setAttribute(name, value);
    else made[name] = value;
  }
  made.append(...children);
  return made;
}

/** A group of fields under a heading. */
function group(title, ...children) {
  return element("fieldset", {}, element("legend", {}, title), ...children);
}

/** A button with words. */
function button(words, onPress, properties = {}) {
  const made = element("button", { type: "button", ...properties }, words);
  made.addEventListener("click", onPress);
  return made;
}

/**
 * A slider with its value in words beside it.
 *
 * @param {object} options
 *     name, label; least, most, step: of the range; value: of a position, and position: of a value, where
 *     they differ; title: help on hover; words: of a value; onInput: called with the value while it moves.
 */
class Slider {
  constructor(options) {
    const { name, label, least, most, step = "any", title = "", words, onInput } = options;
    const { value = (at) => at, position = (of) => of } = options;
    this._words = words;
    this._position = position;
    this._output = element("output");
    this._input = element("input", { type: "range", name, min: least, max: most, step });
    const caption = element("span", {}, label);
    // The slider first: a label belongs to the first field in it, and an output is one.
    this.element = element("label", { className: "slider", title }, caption, this._input, this._output);
    this._input.addEventListener("input", () => {
      const given = value(Number(this._input.value));
      this._tell(given);
      onInput(given);
    });
  }

  /** Show a value; null for one that is not known. */
  show(value) {
    if (value !== null) this._input.value = String(this._position(value));
    this._tell(value);
  }

  _tell(value) {
    const words = value === null ? "–" : this._words(value);
    this.element.classList.toggle("is-unset", value === null);
    this._output.textContent = words;
    this._input.setAttribute("aria-valuetext", value === null ? "not set" : words);
  }
}

/** A list of choices; `onChange` gets the value of one. */
class Choice {
  constructor({ name, label, options, onChange }) {
    this._select = element("select", { name });
    this.element = element("label", { className: "choice" }, element("span", {}, label), this._select);
    this._select.addEventListener("change", () => onChange(this._select.value));
    this.offer(options);
  }

  /** Offer these, each [value, words, title], or under headings, each {heading, options}. */
  offer(options) {
    const { value } = this._select;
    const made = (one) => {
      if (one.heading) return element("optgroup", { label: one.heading }, ...one.options.map(made));
      const [of, words, title = ""] = one;
      return element("option", { value: of, textContent: words, title });
    };
    this._select.replaceChildren(...options.map(made));
    if (Array.from(this._select.options).some((option) => option.value === value)) this._select.value = value;
  }

  get value() {
    return this._select.value;
  }

  show(value) {
    this._select.value = value;
    this._select.title = this._select.selectedOptions[0]?.title ?? "";
  }
}

/** A whole number; `value` is null where there is none within the range. */
class NumberField {
  constructor({ name, label, least, most, value, step = 1 }) {
    const range = { min: least, max: most, step, value, required: true };
    this._input = element("input", { type: "number", name, ...range });
    this.element = element("label", { className: "number" }, element("span", {}, label), this._input);
  }

  get value() {
    return this._input.checkValidity() ? this._input.valueAsNumber : null;
  }

  set value(value) {
    this._input.value = String(value);
  }

  /** Say what is wrong with it, if something is. */
  report() {
    return this._input.reportValidity();
  }
}
