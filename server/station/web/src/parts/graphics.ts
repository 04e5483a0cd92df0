/** Does WebGL run on the processor here? Then smooth edges cost too much, and a picture comes to the screen sooner by way
 * of a plain canvas that lies in memory (Chromium). Asked once. */
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
