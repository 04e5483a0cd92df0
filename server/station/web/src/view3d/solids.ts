/** Unit solids and their common material: lighting by face direction, computed at the corners. */
import { BoxGeometry, BufferGeometry, CylinderGeometry, FrontSide, IcosahedronGeometry, ShaderMaterial, type Object3D, type Side } from "three";
import type { SolidKind } from "./forms";

/** All with full lengths 1 along x, y, z, z up. */
export function unitSolid(kind: SolidKind): BufferGeometry {
  const solid = kind === "box" ? new BoxGeometry(1, 1, 1)
    : kind === "cylinder" ? new CylinderGeometry(0.5, 0.5, 1, 16).rotateX(Math.PI / 2)
    : new IcosahedronGeometry(0.5, 2);
  solid.deleteAttribute("uv");
  return solid;
}

/** Brightness of a face with normal n (unit length); `lightOf` computes the same in the shader. */
export function light(x: number, y: number, z: number): number {
  return 0.5 + 0.5 * Math.max(0.3 * x + 0.45 * y + 0.84 * z, 0) + 0.2 * Math.max(-0.8 * x - 0.6 * y, 0) + 0.12 * z;
}

/** Colours are converted to sRGB at corners: a root for each pixel is expensive in software rendering. */
export const screenColour = /* glsl */ `
  vec3 screenColour(vec3 c) {
    c = clamp(c, 0.0, 1.0);
    return mix(pow(c, vec3(0.41666)) * 1.055 - 0.055, c * 12.92, vec3(lessThanEqual(c, vec3(0.0031308))));
  }`;

const vertexShader = /* glsl */ `
  uniform float cut;
  varying vec3 shade;
  ${screenColour}
  float lightOf(vec3 n) {
    return 0.5 + 0.5 * max(dot(n, vec3(0.3, 0.45, 0.84)), 0.0) + 0.2 * max(dot(n, vec3(-0.8, -0.6, 0.0)), 0.0) + 0.12 * n.z;
  }
  void main() {
    vec3 p = position;
    #ifdef USE_INSTANCING
      p = (instanceMatrix * vec4(p, 1.0)).xyz;
    #endif
    #if defined(DEPTH_ONLY)
      shade = vec3(0.0);
    #elif defined(LIT)
      shade = color.rgb;
    #else
      vec3 n = normal;
      vec3 base = vec3(1.0);
      #ifdef USE_INSTANCING
        n = normalize((instanceMatrix * vec4(n, 0.0)).xyz);
      #endif
      #ifdef USE_COLOR
        base = color;
      #endif
      #ifdef USE_INSTANCING_COLOR
        base = instanceColor;
      #endif
      shade = screenColour(base * lightOf(n));
    #endif
    p.z = min(p.z, cut);
    vec4 seen = modelViewMatrix * vec4(p, 1.0);
    #ifdef DEPTH_ONLY
      seen.xyz *= BEHIND;
    #endif
    gl_Position = projectionMatrix * seen;
  }`;

/** Draws each pixel in the colour that the vertex shader gave, `shade`. */
export const fragmentShader = /* glsl */ `
  varying vec3 shade;
  void main() {
    gl_FragColor = vec4(shade, 1.0);
  }`;

/** Parts higher than `cut` (m) are flattened to it, so that the view looks over walls. `lit`: colours are final. */
export function solidMaterial(options: { colours?: boolean; lit?: boolean; wireframe?: boolean } = {}): ShaderMaterial {
  return new ShaderMaterial({
    vertexShader, fragmentShader, vertexColors: Boolean(options.colours || options.lit), wireframe: options.wireframe ?? false,
    defines: options.lit ? { LIT: "" } : {}, uniforms: { cut: { value: 1e6 } },
  });
}

/** Real surfaces are set back by this factor, so that what lies on them (returns of a laser, lines on the floor) stays
 * visible: 5 cm at 10 m, less than a wall is thick. Scaled about the eye, so that outlines stay. */
const BEHIND = "1.005";
/** Before everything that is drawn in colour. */
const FIRST = -1;

/** Draws no colour, only depth: through glass, a real thing then hides what is behind it and is itself seen. */
export function depthMaterial(side: Side = FrontSide): ShaderMaterial {
  return new ShaderMaterial({ vertexShader, fragmentShader, side, colorWrite: false, defines: { DEPTH_ONLY: "", BEHIND }, uniforms: { cut: { value: 1e6 } } });
}

export function drawnFirst<T extends Object3D>(object: T): T {
  object.traverse((each) => { each.renderOrder = FIRST; });
  return object;
}
