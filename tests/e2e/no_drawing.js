// WebGL 2 that draws nothing: no shader is compiled and no pixel computed, which is most of the work of a page that is
// drawn in software. Three.js finds all that it asks for; what a picture would show, no test that has this looks at.
{
  const GL = WebGL2RenderingContext;
  const { getContext } = HTMLCanvasElement.prototype;
  const COMPLETION_STATUS_KHR = 0x91b1;
  const extensions = {
    EXT_clip_control: { clipControlEXT() {} },
    EXT_color_buffer_float: {},
    KHR_parallel_shader_compile: { COMPLETION_STATUS_KHR },
  };
  const parameters = new Map([
    [GL.VERSION, "WebGL 2.0"], [GL.SHADING_LANGUAGE_VERSION, "WebGL GLSL ES 3.00"],
    [GL.VENDOR, "none"], [GL.RENDERER, "none"], [GL.COMPRESSED_TEXTURE_FORMATS, new Uint32Array()],
  ]);
  for (const name of Object.getOwnPropertyNames(GL)) {
    if (name.startsWith("MAX_")) parameters.set(GL[name], /UNITS|ATTRIBS|SAMPLES|BUFFERS/.test(name) ? 16 : 4096);
  }
  const answers = {
    getContextAttributes() { return { alpha: true, depth: true, premultipliedAlpha: true, ...this.options }; },
    getExtension: (name) => extensions[name] ?? null,
    getSupportedExtensions: () => Object.keys(extensions),
    getParameter(name) {
      if (name === GL.SCISSOR_BOX || name === GL.VIEWPORT) return new Int32Array([0, 0, this.canvas.width, this.canvas.height]);
      return parameters.get(name) ?? 0;
    },
    getError: () => GL.NO_ERROR,
    isContextLost: () => false,
    checkFramebufferStatus: () => GL.FRAMEBUFFER_COMPLETE,
    getShaderPrecisionFormat: () => ({ precision: 23, rangeMin: 127, rangeMax: 127 }),
    getShaderParameter: () => true,
    getProgramParameter: (program, name) => ([GL.LINK_STATUS, COMPLETION_STATUS_KHR].includes(name) ? true : 0),
    getShaderInfoLog: () => "",
    getProgramInfoLog: () => "",
    getUniformLocation: () => null,
    getAttribLocation: () => -1,
    clientWaitSync: () => GL.CONDITION_SATISFIED,
    getSyncParameter: () => GL.SIGNALED,
    readPixels: (x, y, width, height, format, kind, pixels) => { pixels?.fill?.(1); },
  };
  for (const [name, { value }] of Object.entries(Object.getOwnPropertyDescriptors(GL.prototype))) {
    if (typeof value !== "function" || name === "constructor") continue;
    GL.prototype[name] = answers[name] ?? (/^(create|fence)/.test(name) ? () => ({}) : () => {});
  }
  const contexts = new WeakMap();
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    if (!kind.startsWith("webgl")) return getContext.call(this, kind, options);
    if (!contexts.has(this)) {
      const context = Object.create(GL.prototype, {
        canvas: { value: this },
        options: { value: options },
        drawingBufferWidth: { get: () => this.width },
        drawingBufferHeight: { get: () => this.height },
        drawingBufferColorSpace: { value: "srgb", writable: true },
        unpackColorSpace: { value: "srgb", writable: true },
      });
      contexts.set(this, context);
    }
    return contexts.get(this);
  };
}
