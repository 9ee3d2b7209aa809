// A headset that is not there: replaces WebXR by poses that a test gives. XRRigidTransform is native.
(() => {
  const device = {
    modes: ["immersive-vr", "immersive-ar"],
    hasFloor: true,
    refusal: null, // why there is no session
    incompatible: null, // why the graphics card cannot show one
    eyes: [], // {offset: metres to the right of the head, projection: 16 numbers by columns}
    session: null,
    layers: [], // options of each

    /** Hand the page one frame; [r, g, b, a] of the canvas, lowest row first, in the task that painted it. */
    frame(time, [x, y, z], [qx, qy, qz, qw]) {
      const transform = new XRRigidTransform({ x, y, z }, { x: qx, y: qy, z: qz, w: qw });
      const m = transform.matrix;
      const views = device.eyes.map(({ offset, projection }, index) => ({
        eye: index === 0 ? "left" : "right",
        index,
        projectionMatrix: Float32Array.from(projection),
        transform: new XRRigidTransform(
          { x: x + offset * m[0], y: y + offset * m[1], z: z + offset * m[2] },
          transform.orientation,
        ),
      }));
      const { session } = device;
      const asked = session.asked.splice(0);
      for (const callback of asked) callback(time, { session, getViewerPose: () => ({ transform, views }) });
      const { gl } = session.renderState.baseLayer;
      const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      return btoa(Array.from(pixels, (value) => String.fromCharCode(value)).join(""));
    },
  };

  class Session extends EventTarget {
    inputSources = [];
    renderState = {};
    asked = [];
    isEnded = false;

    async requestReferenceSpace(type) {
      if (type === "local-floor" && !device.hasFloor) throw new DOMException("no floor", "NotSupportedError");
      return Object.assign(new EventTarget(), { type });
    }

    requestAnimationFrame(callback) {
      this.asked.push(callback);
    }

    updateRenderState(state) {
      Object.assign(this.renderState, state);
    }

    async end() {
      if (this.isEnded) throw new DOMException("ended", "InvalidStateError");
      this.isEnded = true;
      this.dispatchEvent(new Event("end"));
    }

    squeeze(inputSource, isHeld) {
      this.dispatchEvent(Object.assign(new Event(isHeld ? "squeezestart" : "squeezeend"), { inputSource }));
    }
  }

  const system = {
    isSessionSupported: async (mode) => device.modes.includes(mode),
    async requestSession(mode) {
      if (device.refusal) throw new DOMException(device.refusal, "NotSupportedError");
      return (device.session = Object.assign(new Session(), { mode }));
    },
  };
  Object.defineProperty(navigator, "xr", { value: system, configurable: true });
  WebGL2RenderingContext.prototype.makeXRCompatible = async () => {
    if (device.incompatible) throw new DOMException(device.incompatible, "InvalidStateError");
  };
  window.XRWebGLLayer = class {
    framebuffer = null;
    fixedFoveation = 0;

    constructor(session, gl, options) {
      this.gl = gl;
      device.layers.push(options);
    }

    getViewport({ index }) {
      const width = this.gl.drawingBufferWidth / device.eyes.length;
      return { x: index * width, y: 0, width, height: this.gl.drawingBufferHeight };
    }
  };
  window.device = device;
})();
