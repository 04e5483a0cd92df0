/** Names over the 3D view, on a separate flat canvas, so that text does not slow down the scene. */
import { Vector3, type PerspectiveCamera } from "three";

export interface Name { x: number; y: number; z: number; text: string; ink: string }
const MOST = 70;

/** `picture`: drawn below the names; null if it has a canvas of its own. */
export function drawNames(canvas: HTMLCanvasElement, picture: HTMLCanvasElement | null, camera: PerspectiveCamera, names: Name[], halo: string) {
  const g = canvas.getContext("2d", { alpha: !picture, willReadFrequently: picture !== null });
  if (!g) return;
  const width = canvas.clientWidth, height = canvas.clientHeight, ratio = picture ? 1 : devicePixelRatio;
  if (canvas.width !== width * ratio || canvas.height !== height * ratio) {
    canvas.width = width * ratio;
    canvas.height = height * ratio;
  }
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  if (picture) g.drawImage(picture, 0, 0, width, height);
  else g.clearRect(0, 0, width, height);
  g.font = "11px system-ui, sans-serif";
  g.textAlign = "center";
  g.lineJoin = "round";
  g.strokeStyle = halo;
  g.lineWidth = 3;
  const at = new Vector3();
  const seen = names.map((name) => ({ name, distance: at.set(name.x, name.y, name.z).distanceTo(camera.position) })).sort((a, b) => a.distance - b.distance).slice(0, MOST);
  for (const { name } of seen.reverse()) {
    at.set(name.x, name.y, name.z).project(camera);
    if (at.z > 1 || Math.abs(at.x) > 1.05 || Math.abs(at.y) > 1.05) continue;
    const px = ((at.x + 1) / 2) * width, py = ((1 - at.y) / 2) * height;
    g.strokeText(name.text, px, py);
    g.fillStyle = name.ink;
    g.fillText(name.text, px, py);
  }
}
