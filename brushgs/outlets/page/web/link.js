// The link of what is shown: "#view=30,12,1.2,0,0,0&share=60&brush=2&ground=white".

const VIEW_DIGITS = 5; // significant digits of a number in a link
const GROUND_NAMES = ["own", "white", "black", "none"];

/** What is shown, as the text after "#". */
function linkText(app) {
  const { controls, look } = app;
  const view = controls.orbit.numbersOf(controls.resting).map((value) => Number(value.toPrecision(VIEW_DIGITS)));
  const words = [`view=${view.join(",")}`];
  if (look.share !== 1) words.push(`share=${Math.round(100 * look.share)}`);
  if (look.brush !== null) words.push(`brush=${look.brush + 1}`);
  const ground = app.panel.groundChoice;
  if (app.player.duration > 0) words.push(`t=${Number(app.player.seconds.toFixed(2))}`);
  if (ground !== "own") words.push(`ground=${ground.replace("#", "")}`);
  return words.join("&");
}

/** Show what the text after "#" says; what a page does not know is passed over. Whether it says a view. */
function openLink(app, text) {
  const words = new URLSearchParams(text.replace(/^#/, ""));
  const { controls, panel } = app;
  const share = Number(words.get("share"));
  if (share >= 10 && share <= 100) panel.chooseShare(Math.round(share));
  const brush = Number(words.get("brush"));
  if (Number.isInteger(brush) && brush > 0) panel.chooseBrush(brush - 1);
  const ground = words.get("ground") ?? "";
  if (GROUND_NAMES.includes(ground)) panel.chooseGround(ground);
  else if (/^[0-9a-f]{6}$/i.test(ground)) panel.chooseGround(`#${ground.toLowerCase()}`);
  const seconds = words.has("t") ? Number(words.get("t")) : NaN;
  if (seconds >= 0 && app.player.duration > 0) {
    app.player.setPlaying(false);
    app.player.seek(seconds);
  }
  const state = controls.orbit.stateOf((words.get("view") ?? "").split(",").map(Number));
  if (state) controls.jump(state);
  return state !== null;
}

/** Code for another page that shows this one. */
function embedCode(address, title) {
  const quoted = (text) => text.replace(/[&"<>]/g, (letter) => `&#${letter.charCodeAt(0)};`);
  return `<iframe src="${quoted(address)}" title="${quoted(title)}" width="800" height="600" `
    + 'style="border:0;max-width:100%" loading="lazy" allow="fullscreen; xr-spatial-tracking; clipboard-write">'
    + "<\/iframe>";
}
