// Bundles src/ into dist/: the module and what it loads later, the page, the Draco decoder, and single.js for
// `facefolds export-html`. dist/ works from any static server, offline.
import { cp, mkdir, readFile, rm, stat } from "node:fs/promises";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const out = join(here, "dist");
const three = dirname(createRequire(import.meta.url).resolve("three"));
const draco = join(three, "../examples/jsm/libs/draco/gltf"); // without point clouds: a third smaller
const wasm = join(draco, "draco_decoder.wasm");
const wrapper = join(draco, "draco_wasm_wrapper.js");

const common = {
  bundle: true,
  target: "es2022",
  minify: true,
  loader: { ".css": "text" },
  logLevel: "warning",
  define: { DRACO_BYTES: String((await stat(wasm)).size) },
};

await rm(out, { recursive: true, force: true });
await mkdir(join(out, "draco"), { recursive: true });
const modules = { ...common, outdir: out, splitting: true, format: "esm", sourcemap: true, legalComments: "linked" };
await build({
  ...modules,
  entryPoints: { "facefolds-player": join(here, "src/index.js"), page: join(here, "src/page.js") },
  external: ["./recording.js"],
});
// By itself: what it shares with the player would else be loaded before the first picture with all that it alone needs.
// Two copies of mediabunny hand nothing to each other; it warns where it finds its own mark.
const banner = { js: 'delete globalThis[Symbol.for("mediabunny loaded")];' };
await build({ ...modules, entryPoints: [join(here, "src/recording.js")], banner });
await cp(join(here, "public"), out, { recursive: true });
for (const file of [wrapper, wasm]) await cp(file, join(out, "draco", file.slice(draco.length + 1)));
const worker = { ...common, entryPoints: [join(here, "src/draco/worker.js")], format: "iife" };
await build({
  ...worker,
  outfile: join(out, "draco/worker.js"),
  banner: { js: 'importScripts("draco_wasm_wrapper.js");' },
});
const bare = await build({ ...worker, write: false });

const texts = {
  wrapper: await readFile(wrapper, "utf8"),
  worker: bare.outputFiles[0].text,
  wasm: (await readFile(wasm)).toString("base64"),
};
await build({
  ...common,
  entryPoints: [join(here, "src/single.js")],
  outfile: join(out, "single.js"),
  format: "iife",
  charset: "ascii",
  define: { ...common.define, "import.meta.url": "document.baseURI" },
  plugins: [
    {
      name: "no-hls", // for what is fetched: here all is at hand
      setup(plugged) {
        plugged.onResolve({ filter: /^hls\.js/ }, () => ({ path: "hls.js", namespace: "none" }));
        plugged.onLoad({ filter: /.*/, namespace: "none" }, () => ({ contents: "export default null;" }));
      },
    },
    {
      name: "draco-files",
      setup(plugged) {
        plugged.onResolve({ filter: /^draco-files$/ }, () => ({ path: "draco-files", namespace: "texts" }));
        plugged.onLoad({ filter: /.*/, namespace: "texts" }, () => ({
          contents: Object.entries(texts)
            .map(([name, text]) => `export const ${name} = ${JSON.stringify(text)};`)
            .join("\n"),
        }));
      },
    },
  ],
});
console.log(`built ${out}`);
