// The page: reads the painting in it, and paints.

class App {
  async start() {
    const canvas = document.querySelector("canvas");
    const bytes = bytesOfBase64(document.getElementById("contents").textContent.trim());
    this.contents = await decodeContents(bytes);
    const options = { antialias: false, alpha: true, premultipliedAlpha: true, depth: false };
    this.gl = canvas.getContext("webgl2", options);
    this.painter = new Painter(this.gl, this.contents);
    const { width, height } = this.contents.header.camera;
    Object.assign(canvas, { width, height });
    this.camera = PageCamera.ofHeader(this.contents.header);
    this.painter.paint(this.camera);
  }
}

window.brushgs = new App();
document.addEventListener("DOMContentLoaded", () => {
  window.brushgs.ready = window.brushgs.start();
});
