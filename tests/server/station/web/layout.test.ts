import { formatAddress, layout, layoutsOf, parseAddress } from "../../../../server/station/web/src/layout/layouts";
import type { Role } from "../../../../server/station/web/src/session/protocol";
import { strings } from "../../../../server/station/web/src/strings.en";

const roles: Role[] = ["observer", "trainee", "instructor", "admin"];

describe("layouts", () => {
  test("a URL gives back the view that made it", () => {
    const view = { layout: "scene", robot: "rover & co", layers: ["model", "scan"] } as const;
    expect(parseAddress(formatAddress("observer", { ...view, layers: [...view.layers] }), "observer")).toEqual(view);
  });

  test("a URL without layers leaves the usual ones, one with an empty list none", () => {
    expect(parseAddress("#observer/watch", "observer").layers).toBeNull();
    expect(parseAddress("#observer/watch?layers=", "observer").layers).toEqual([]);
  });

  test("a layout of another role, or none, gives the role's first", () => {
    for (const hash of ["#instructor/direct", "#", "", "#trainee/../../x?robot", "#%"]) expect(parseAddress(hash, "trainee").layout).toBe("drive");
  });

  test("each role has layouts, and what they show has a title", () => {
    for (const role of roles) {
      expect(layoutsOf(role).length).toBeGreaterThan(1);
      for (const name of layoutsOf(role)) {
        expect(strings.layouts[name]).toBeTruthy();
        const panels = layout(name).flatMap((column) => column.cells.flatMap((cell) => cell.panels));
        for (const panel of panels) expect(strings.panels[panel]).toBeTruthy();
        expect(new Set(panels).size).toBe(panels.length);
      }
    }
  });

  test("who may not instruct is given no instructor's panel", () => {
    for (const role of ["observer", "trainee"] as const)
      for (const name of layoutsOf(role)) expect(layout(name).flatMap((column) => column.cells.flatMap((cell) => cell.panels))).not.toContain("instructor");
  });
});
