/** Unit solids and the one material that all of them share: light by the direction of a face, computed at its corners. */
import { BoxGeometry, BufferGeometry, Color, CylinderGeometry, DoubleSide, FrontSide, IcosahedronGeometry, ShaderMaterial } from "three";

export type SolidKind = "box" | "cylinder" | "sphere";

/** All with full lengths 1 along x, y, z, z up. */
export function unitSolid(kind: SolidKind): BufferGeometry {
  const solid = kind === "box" ? new BoxGeometry(1, 1, 1)
    : kind === "cylinder" ? new CylinderGeometry(0.5, 0.5, 1, 12).rotateX(Math.PI / 2)
    : new IcosahedronGeometry(0.5, 1);
  solid.deleteAttribute("uv");
  return solid;
}

const vertexShader = /* glsl */ `
  uniform float cut;
  varying vec3 shade;
  #include <common>
  void main() {
    vec3 p = position;
    vec3 n = normal;
    #ifdef USE_INSTANCING
      p = (instanceMatrix * vec4(p, 1.0)).xyz;
      n = normalize((instanceMatrix * vec4(n, 0.0)).xyz);
    #endif
    p.z = min(p.z, cut);
    float light = 0.5 + 0.5 * max(dot(n, vec3(0.3, 0.45, 0.84)), 0.0) + 0.2 * max(dot(n, vec3(-0.8, -0.6, 0.0)), 0.0) + 0.12 * n.z;
    vec3 base = vec3(1.0);
    #ifdef USE_COLOR
      base = color;
    #endif
    #ifdef USE_INSTANCING_COLOR
      base = instanceColor;
    #endif
    shade = base * light;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(p, 1.0);
  }`;

const fragmentShader = /* glsl */ `
  uniform float opacity;
  varying vec3 shade;
  void main() {
    gl_FragColor = vec4(shade, opacity);
    #include <colorspace_fragment>
  }`;

/** What is higher than `cut` (m) is pressed down to it: walls are looked over. */
export function solidMaterial(options: { colours?: boolean; opacity?: number; wireframe?: boolean; cut?: number } = {}): ShaderMaterial {
  const opacity = options.opacity ?? 1;
  return new ShaderMaterial({
    vertexShader, fragmentShader, vertexColors: options.colours ?? false, wireframe: options.wireframe ?? false,
    transparent: opacity < 1, depthWrite: opacity === 1, side: opacity < 1 ? DoubleSide : FrontSide,
    uniforms: { cut: { value: options.cut ?? 1e6 }, opacity: { value: opacity } },
  });
}

/** The scheme's colours, linear. */
export const linear = (css: string) => new Color(css);
