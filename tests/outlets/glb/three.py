"""three.js, as trimesh brings it in its viewer: what that program shows of a .glb file under a lamp."""

import base64
import io
import re
import zipfile
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

TEMPLATE = Path(trimesh.__file__).parent / "resources" / "templates" / "viewer.zip"
SCRIPT = """
const scene = new THREE.Scene(), renderer = new THREE.WebGLRenderer({preserveDrawingBuffer: true});
renderer.setSize(WIDTH, HEIGHT); renderer.outputEncoding = THREE.sRGBEncoding;
document.body.appendChild(renderer.domElement);
let view;
const loaded = new Promise(resolve => new THREE.GLTFLoader().load("data:;base64,CONTENT", gltf => {
  scene.add(gltf.scene); scene.updateMatrixWorld(true); view = gltf.cameras[0];
  resolve(gltf.parser.json.materials);
}));
// A lamp from a direction of the picture: right, up, toward the eye; or light from all sides.
async function shown(right, up, toward) {
  await loaded;
  const lamp = right === null ? new THREE.AmbientLight(0xffffff, Math.PI)
    : new THREE.DirectionalLight(0xffffff, Math.PI / toward);
  if (right !== null) lamp.position.set(right, up, toward).transformDirection(view.matrixWorld);
  renderer.physicallyCorrectLights = true;
  scene.add(lamp); renderer.render(scene, view); scene.remove(lamp);
  return renderer.domElement.toDataURL("image/png");
}
"""


def page_of(glb, path, width, height):
    """Write a page that shows a .glb file."""
    with zipfile.ZipFile(TEMPLATE) as archive:
        whole = archive.read("viewer.html.template").decode()
    library = whole[whole.index("<script>") + len("<script>") : whole.index("var camera,controls,scene")]
    script = SCRIPT.replace("CONTENT", base64.b64encode(Path(glb).read_bytes()).decode())
    script = script.replace("WIDTH", str(width)).replace("HEIGHT", str(height))
    assert re.search(r"three\.js authors", library, re.IGNORECASE)
    Path(path).write_text(f"<!DOCTYPE html><meta charset=utf-8><body><script>{library}\n{script}</script>")


def lit(page, right=None, up=None, toward=None):
    """[h, w, 3] display-encoded, 0 to 1, under a lamp from there; without one, under light from all sides."""
    url = page.evaluate("place => shown(...place)", [right, up, toward])
    with Image.open(io.BytesIO(base64.b64decode(url.split(",")[1]))) as picture:
        return np.asarray(picture.convert("RGB"), np.float64) / 255
