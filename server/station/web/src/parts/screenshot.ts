/** The page as a picture: its elements with their styles in an SVG, canvases as images. Makes no request to the
 * server. */

const redraws = new Set<() => void>();

/** For canvases that do not keep their content: called just before the picture is taken. Returns a function that
 * removes it. */
export function drawsForPicture(redraw: () => void): () => void {
  redraws.add(redraw);
  return () => { redraws.delete(redraw); };
}

export async function pageAsPng(): Promise<Blob> {
  for (const redraw of redraws) redraw();
  const { innerWidth: width, innerHeight: height } = window, ratio = devicePixelRatio;
  const clone = document.documentElement.cloneNode(true) as HTMLElement;
  keepState(document.documentElement, clone);
  for (const each of clone.querySelectorAll("script, link, style")) each.remove();
  const style = document.createElement("style");
  style.textContent = sheets();
  clone.querySelector("head")?.append(style);
  // XML allows no control characters, HTML does.
  const text = new XMLSerializer().serializeToString(clone).replace(/[\u0000-\u0008\u000b\u000c\u000e-\u001f]/g, "");
  const svg = `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}"><foreignObject width="100%" height="100%">${text}</foreignObject></svg>`;
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  await image.decode();
  const canvas = document.createElement("canvas");
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  canvas.getContext("2d")?.drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((done, fail) => canvas.toBlob((blob) => (blob ? done(blob) : fail(new Error("no picture"))), "image/png"));
}

/** Within an SVG the root is the SVG, so rules for :root are applied to html there. */
function sheets(): string {
  const rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules].map((rule) => rule.cssText));
  return `${rules.join("\n").replaceAll(":root", "html")}\n* { scrollbar-width: none !important; }`;
}

/** State that a copy of the elements lacks: input values, selections, scroll positions, canvas content. */
function keepState(from: Element, to: Element) {
  const pairs = (selector: string) => [...from.querySelectorAll(selector)].map((each, i) => [each, to.querySelectorAll(selector)[i]] as const);
  for (const [input, copy] of pairs("input")) {
    copy?.setAttribute("value", (input as HTMLInputElement).type === "password" ? "" : (input as HTMLInputElement).value);
    copy?.toggleAttribute("checked", (input as HTMLInputElement).checked);
  }
  for (const [option, copy] of pairs("option")) copy?.toggleAttribute("selected", (option as HTMLOptionElement).selected);
  for (const [list, copy] of pairs("*"))
    if (list.scrollTop > 0) for (const child of copy?.children ?? []) (child as HTMLElement).style.transform = `translateY(-${list.scrollTop}px)`;
  for (const [canvas, copy] of pairs("canvas")) {
    const picture = document.createElement("img"), style = getComputedStyle(canvas);
    picture.src = (canvas as HTMLCanvasElement).toDataURL();
    for (const name of ["position", "inset", "width", "height", "object-fit", "display", "visibility", "opacity", "filter"]) picture.style.setProperty(name, style.getPropertyValue(name));
    copy?.replaceWith(picture);
  }
}

export function download(blob: Blob, name: string) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
