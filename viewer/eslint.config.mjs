import js from "@eslint/js";
import globals from "globals";

export default [
  { ignores: ["dist/", "node_modules/"] },
  js.configs.recommended,
  {
    languageOptions: { globals: { ...globals.browser, XRWebGLLayer: "readonly" } },
    rules: { eqeqeq: ["error", "always", { null: "ignore" }], "no-var": "error", "prefer-const": "error" },
  },
  { files: ["src/draco/decoder.js"], languageOptions: { globals: { DRACO_BYTES: "readonly" } } },
  { files: ["build.mjs", "test/**"], languageOptions: { globals: { ...globals.node } } },
];
