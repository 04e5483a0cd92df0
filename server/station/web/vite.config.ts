import { svelte } from "@sveltejs/vite-plugin-svelte";
import { defineConfig } from "vitest/config";

export default defineConfig({
  plugins: [svelte()],
  base: "./",
  build: {
    target: "es2022",
    // Deterministic output: the built page is committed, and a check builds it again.
    reportCompressedSize: false,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1000,
    rollupOptions: {
      output: {
        // Served with an ETag, so names need no hash, and a rebuild changes files rather than renaming them.
        entryFileNames: "assets/[name].js",
        // three.js is not part of the first load; tools/page counts the rest.
        chunkFileNames: ({ name, moduleIds }) => (!name.startsWith("View3d") && moduleIds.some((id) => id.includes("/three/")) ? "assets/View3d[name].js" : "assets/[name].js"),
        assetFileNames: "assets/[name][extname]",
      },
    },
  },
  server: {
    fs: { allow: ["../../.."] },  // access to the tests
    proxy: { "/api": proxied(), "/ws": { ...proxied(), ws: true }, "/video.mjpg": proxied() },
  },
  test: { globals: true, dir: "../../../tests/server/station/web", environment: "node" },
});

/** `npx vite` serves the page during development; PARHELION names its server. */
function proxied() {
  const target = process.env.PARHELION ?? "http://127.0.0.1:8080";
  return { target, changeOrigin: true, secure: false, headers: { origin: target } };
}
