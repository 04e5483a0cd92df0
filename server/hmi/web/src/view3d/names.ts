/** Names over the 3D view, on a flat canvas of their own: text costs the scene nothing. */
import { Vector3, type PerspectiveCamera } from "three";

export interface Name { x: number; y: number; z: number; text: string; ink: string }
const MOST = 70;

export function drawNames(canvas: HTMLCanvasElement, camera: PerspectiveCamera, names: Name[], halo: string) {
  const g = canvas.getContext("2d");
  if (!g) return;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== width * devicePixelRatio || canvas.height !== height * devicePixelRatio) {
    canvas.width = width * devicePixelRatio;
    canvas.height = height * devicePixelRatio;
  }
  g.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
  g.clearRect(0, 0, width, height);
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
