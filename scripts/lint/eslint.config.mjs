// Rules for the scripts of the pages (static/, examples/): mistakes, and one way of formatting. `sh scripts/lint.sh` checks,
// `sh scripts/lint.sh --fix` also formats. Nothing of this is shipped.
import js from "@eslint/js";
import stylistic from "@stylistic/eslint-plugin";
import globals from "globals";

// Scripts alone on their page. Those of viser's page share it with others: they keep their names to themselves.
const ALONE = ["landing", "docs"].map((name) => `static/${name}.js`);

export default [
  { ignores: ["static/vendor/**"] },
  js.configs.recommended,
  stylistic.configs.customize({ quotes: "double", semi: true, braceStyle: "1tbs", arrowParens: true, quoteProps: "as-needed" }),
  {
    files: ["static/*.js", "static/takehome/*.js", "examples/*/*.js"],
    languageOptions: {
      ecmaVersion: 2023,
      sourceType: "script",
      // static/dom.js, viser_page.js, channel.js and morphdom come first in viser's page, docs.js after the library of docs.html, and three.js, the
      // kernels of an arm and static/takehome/numbers.js first in a saved page.
      globals: { ...globals.browser, dom: "readonly", viserPage: "readonly", channel: "readonly", morphdom: "readonly", SwaggerUIBundle: "readonly", THREE: "readonly", kernels: "readonly", kinboard: "readonly" },
    },
    linterOptions: { reportUnusedDisableDirectives: "error" },
    rules: {
      eqeqeq: "error",
      "no-implicit-globals": ["error", { lexicalBindings: true }],
      "no-shadow": "error",
      "no-unused-vars": ["error", { varsIgnorePattern: "^(dom|viserPage|channel)$" }],
      "no-use-before-define": ["error", { functions: false, variables: false }],
      "no-var": "error",
      "object-shorthand": "error",
      "prefer-const": "error",
      "@stylistic/max-len": ["error", { code: 140, ignoreTemplateLiterals: true, ignoreStrings: true }],
      "@stylistic/quotes": ["error", "double", { avoidEscape: true, allowTemplateLiterals: "always" }],
      // Short statements stand in one line.
      "@stylistic/brace-style": ["error", "1tbs", { allowSingleLine: true }],
      "@stylistic/max-statements-per-line": ["error", { max: 4 }],
      "@stylistic/multiline-ternary": "off",
      "@stylistic/no-mixed-operators": "off",
      "@stylistic/operator-linebreak": ["error", "before", { overrides: { "=": "after" } }],
    },
  },
  { files: ALONE, rules: { "no-implicit-globals": "off" } },
  // The one constant of each is what the other scripts call.
  ...["dom", "viserPage", "channel"].map((name) => ({
    files: [`static/${{ dom: "dom", viserPage: "viser_page", channel: "channel" }[name]}.js`],
    languageOptions: { globals: { [name]: "off" } },
    rules: { "no-implicit-globals": "off" },
  })),
];
