/** The site as camera images recorded it: one mesh with one picture. Surfaces face the free side, so a view from above
 * looks through ceilings, and one from outside through walls. */
import { BufferAttribute, BufferGeometry, LinearFilter, Mesh, NoColorSpace, ShaderMaterial, Texture } from "three";
import type { Recorded } from "../session/recorded";

const vertexShader = /* glsl */ `
  attribute float seen;
  varying vec2 place;
  varying vec3 at;
  varying float known;
  void main() {
    place = uv;
    at = position;
    known = seen;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }`;

/** What no image shows is hatched, as in the pictures of virtual cameras. */
const fragmentShader = /* glsl */ `
  uniform sampler2D picture;
  uniform float cut;
  varying vec2 place;
  varying vec3 at;
  varying float known;
  void main() {
    if (at.z > cut) discard;
    float stripe = step(0.5, fract((at.x + at.y + at.z) * 6.0));
    gl_FragColor = vec4(known > 0.5 ? texture2D(picture, place).rgb : vec3(0.42 + 0.08 * stripe), 1.0);
  }`;

export class RecordedSurface {
  readonly mesh: Mesh<BufferGeometry, ShaderMaterial>;

  constructor(recorded: Recorded) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(recorded.positions, 3));
    geometry.setAttribute("uv", new BufferAttribute(recorded.places, 2));
    geometry.setAttribute("seen", new BufferAttribute(recorded.seen, 1));
    geometry.setIndex(new BufferAttribute(recorded.corners, 1));
    const picture = new Texture(recorded.picture);
    // Neighbours in the picture are no neighbours in the site: a coarser level would mix them.
    picture.generateMipmaps = false;
    picture.minFilter = picture.magFilter = LinearFilter;
    picture.flipY = false;
    picture.colorSpace = NoColorSpace;
    picture.needsUpdate = true;
    this.mesh = new Mesh(geometry, new ShaderMaterial({ vertexShader, fragmentShader, uniforms: { picture: { value: picture }, cut: { value: 1e6 } } }));
    this.mesh.name = "recorded";
  }

  set cut(height: number) {
    this.mesh.material.uniforms.cut!.value = height;
  }
}
