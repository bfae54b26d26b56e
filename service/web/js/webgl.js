// What there is to draw with.

const SOFTWARE = /swiftshader|llvmpipe|software|basic render/i;

/** null without WebGL; else whether it is drawn by software, where every pixel counts. */
export function drawing() {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) return null;
  const names = gl.getExtension("WEBGL_debug_renderer_info");
  const software = Boolean(names) && SOFTWARE.test(gl.getParameter(names.UNMASKED_RENDERER_WEBGL));
  // Browsers keep but a few contexts alive.
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return { software };
}
