// Bundles src/ into dist/: one module, the page, and the Draco decoder. dist/ works from any static server, offline.
import { cp, mkdir, rm } from "node:fs/promises";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const out = join(here, "dist");
const draco = join(dirname(createRequire(import.meta.url).resolve("three")), "../examples/jsm/libs/draco");

await rm(out, { recursive: true, force: true });
await mkdir(join(out, "draco"), { recursive: true });
await build({
  entryPoints: { "facefolds-player": join(here, "src/index.js"), page: join(here, "src/page.js") },
  outdir: out,
  bundle: true,
  splitting: true,
  format: "esm",
  target: "es2022",
  minify: true,
  sourcemap: true,
  legalComments: "linked",
  loader: { ".css": "text" },
  logLevel: "warning",
});
await cp(join(here, "public"), out, { recursive: true });
for (const file of ["draco_wasm_wrapper.js", "draco_decoder.wasm"])
  await cp(join(draco, file), join(out, "draco", file));
console.log(`built ${out}`);
