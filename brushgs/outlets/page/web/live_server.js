// What the page asks of the server of `brushgs view`. A cookie that came with the page says who asks.

const RETRY_AFTER = 2000; // ms, when the server does not answer

/** The server; every method throws an Error with a sentence where it refuses or does not answer. */
class StudioServer {
  /** The state, as soon as it is another than the one of this number. */
  state(known) {
    return this._json(`/state?known=${known}`);
  }

  choices() {
    return this._json("/choices");
  }

  /** The painting, as `decodeContents` takes it. */
  async contents() {
    const answer = await this._ask("/contents");
    return new Uint8Array(await answer.arrayBuffer());
  }

  /** Change the painting; the number of the state since then. */
  async change(settings) {
    return (await this._post("/settings", settings)).number;
  }

  /** Keep the moment of a moving scene, in seconds. */
  keepMoment(seconds) {
    return this._post("/moment", { seconds });
  }

  /** Keep a picture that was dropped; its id. */
  async addFile(file) {
    const path = `/file?name=${encodeURIComponent(file.name)}`;
    const answer = await this._ask(path, { method: "POST", body: file });
    return (await answer.json()).id;
  }

  /** Open a scene that was dropped; `onSent` is called with the share of it that was sent, 0 to 1. */
  addScene(file, onSent) {
    return new Promise((resolve, reject) => { // fetch does not tell how much was sent
      const request = new XMLHttpRequest();
      request.upload.addEventListener("progress", ({ loaded, total }) => onSent(loaded / total));
      request.addEventListener("error", () => reject(new ServerGone()));
      request.addEventListener("load", () => {
        if (request.status === 200) resolve();
        else reject(refusal(request.status, request.responseText));
      });
      request.open("POST", `/scene?name=${encodeURIComponent(file.name)}`);
      request.send(file);
    });
  }

  /** Open a scene that the server knows. */
  open(id) {
    return this._ask(`/open?id=${id}`, { method: "POST", body: "{}" });
  }

  /** Have a picture painted. */
  render(request) {
    return this._post("/render", request);
  }

  /** Have a video painted. */
  video(request) {
    return this._post("/video", request);
  }

  /** The strokes in a part of the scene, as text. */
  find(where) {
    return this._post("/where", { where });
  }

  /** Paint over the scene; the number of the state since then, null where nothing took it. */
  stroke(request) {
    return this._post("/stroke", request);
  }

  /** "undo" or "redo" a stroke. */
  step(way) {
    return this._post(`/${way}`, {});
  }

  /** Stop a picture or a video. */
  stop(id) {
    return this._ask(`/stop?id=${id}`, { method: "POST", body: "{}" });
  }

  /** A picture or a video that was written, as a blob. */
  async output(id) {
    return (await this._ask(`/output?id=${id}`)).blob();
  }

  async _json(path) {
    return (await this._ask(path)).json();
  }

  async _post(path, value) {
    const answer = await this._ask(path, { method: "POST", body: JSON.stringify(value) });
    return answer.json();
  }

  async _ask(path, options = {}) {
    let answer;
    try {
      answer = await fetch(path, { credentials: "same-origin", redirect: "error", ...options });
    } catch {
      throw new ServerGone();
    }
    if (answer.ok) return answer;
    throw refusal(answer.status, await answer.text());
  }
}

/** An Error with the sentence of a refused request. */
function refusal(status, text) {
  try {
    return new Error(JSON.parse(text).error);
  } catch {
    return new Error(`the server answered ${status}`);
  }
}

/** The server does not answer: it was stopped. */
class ServerGone extends Error {
  constructor() {
    super("The server was stopped. Run `brushgs view` again, and open the address that it prints.");
  }
}
