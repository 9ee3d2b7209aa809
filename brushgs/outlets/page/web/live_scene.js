// The field of the studio for the scene: those that the server knows, and files that are chosen or dropped.

/** The field; `element` is to be put into the panel. */
class SceneField {
  /**
   * @param {StudioServer} server
   * @param {function(string)} say
   * @param {object} choices scenes: known ones, id and name; recent: ids of those that were shown, the last one first
   */
  constructor(server, say, { scenes, recent }) {
    this._server = server;
    this._say = say;
    this._id = null; // of the scene that is shown
    this._choice = new Choice({
      name: "scene",
      label: "Open",
      options: offered(scenes, recent),
      onChange: (id) => this._try(() => this._server.open(id)),
    });
    const own = filePicker("Scene file …", (file) => this.add(file), "");
    this._sent = element("progress", { max: 1, "aria-label": "Sending", hidden: true });
    this.element = group("Scene", this._choice.element, own, this._sent);
  }

  /** Send a scene file and open it. */
  async add(file) {
    this._say(`Sending ${file.name} …`);
    this._sent.hidden = false;
    await this._try(() => this._server.addScene(file, (share) => { this._sent.value = share; }));
    this._sent.hidden = true;
    this._sent.value = 0;
  }

  /** A state came: another scene has another page, whose camera and words are its own. */
  show({ scene, progress }) {
    if (this._id !== null && scene !== this._id) {
      if (location.hash) history.replaceState(null, "", "/"); // the view of a link was of the scene before
      location.reload();
    }
    this._id = scene;
    if (progress === null) this._choice.show(scene);
  }

  async _try(open) {
    try {
      await open();
    } catch (error) {
      this._say(error.message);
      this._choice.show(this._id);
    }
  }
}

/** The scenes as options; those that were shown come first, where there are several. */
function offered(scenes, recent) {
  const option = ({ id, name }) => [id, name];
  if (recent.length < 2) return scenes.map(option);
  const shown = recent.map((id) => scenes.find((scene) => scene.id === id)).filter(Boolean);
  const others = scenes.filter(({ id }) => !recent.includes(id));
  const groups = [{ heading: "Recent", options: shown.map(option) }];
  return others.length ? [...groups, { heading: "Others", options: others.map(option) }] : groups;
}
