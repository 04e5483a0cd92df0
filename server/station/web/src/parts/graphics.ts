/** True if WebGL is rendered in software. Then antialiasing costs too much, and a frame is displayed sooner through
 * a plain canvas in memory (Chromium). Evaluated once. */
let known: boolean | undefined;

export function drawsBySoftware(): boolean {
  if (known === undefined) {
    const gl = document.createElement("canvas").getContext("webgl2");
    const about = gl?.getExtension("WEBGL_debug_renderer_info");
    const name = gl && about ? String(gl.getParameter(about.UNMASKED_RENDERER_WEBGL)) : "";
    gl?.getExtension("WEBGL_lose_context")?.loseContext();
    known = !gl || /swiftshader|llvmpipe|software|basic render/i.test(name);
  }
  return known;
}
