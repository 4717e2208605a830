// Bundles the view and three.js into ../static/viewer.js, with the licence of three.js at its head.
import { build } from "esbuild";
import { readFileSync } from "node:fs";

const licence = readFileSync("node_modules/three/LICENSE", "utf8").trim();
const { version } = JSON.parse(readFileSync("node_modules/three/package.json", "utf8"));
await build({
  entryPoints: ["src/index.js"],
  bundle: true,
  minify: true,
  format: "iife",
  globalName: "MeshwrightViewer",
  target: "es2022",
  legalComments: "none",
  charset: "ascii",
  banner: { js: `/*! three.js ${version}\n${licence}\n*/` },
  outfile: "../static/viewer.js",
});
