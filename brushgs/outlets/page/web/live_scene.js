// The field of the studio for the scene: those that the server knows, and files that are chosen or dropped.

/** The field; `element` is to be put into the panel. */
class SceneField {
  /** @param {StudioServer} server @param {function(string)} say @param {object[]} scenes known ones: id, name */
  constructor(server, say, scenes) {
    this._server = server;
    this._say = say;
    this._id = null; // of the scene that is shown
    this._choice = new Choice({
      name: "scene",
      label: "Open",
      options: scenes.map(({ id, name }) => [id, name]),
      onChange: (id) => this._try(() => this._server.open(id)),
    });
    const own = filePicker("Scene file …", (file) => this.add(file), "");
    this.element = group("Scene", this._choice.element, own);
  }

  /** Send a scene file and open it. */
  add(file) {
    this._say(`Sending ${file.name} …`);
    return this._try(() => this._server.addScene(file));
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
