// Two builds of the same page. `hosted`: files beside each other, and a service worker that keeps them for offline. `single`: one file
// that works from a disk, the worker as text and the module as packed text within it.

import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";
import { build, defineConfig, type Plugin } from "vite";

const WASM = "wasm/pkg/glasswarp_web_bg.wasm";
/** From `asked`, which the page imports, to what it is given. */
const ASKED = "virtual:glasswarp";
const GIVEN = `\0${ASKED}`;

const HOSTED = `
import url from "/${WASM}?url";
import GlasswarpWorker from "/src/worker.ts?worker";
export const compiledModule = async () => {
  const response = await fetch(url);
  if (!response.ok) throw new Error(\`the solver could not be loaded: \${response.status} \${response.statusText}\`);
  // A server that does not know the type of .wasm would refuse streaming.
  return response.headers.get("content-type") === "application/wasm" ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
};
export const newWorker = () => new GlasswarpWorker();
`;

/** The worker as one script. */
async function workerText(): Promise<string> {
  const made = await build({
    configFile: false,
    logLevel: "warn",
    // Where the module would be fetched from, were it not given.
    define: { "import.meta.url": JSON.stringify("blob:") },
    build: { write: false, minify: true, rollupOptions: { input: "src/worker.ts", output: { format: "iife" } } },
  });
  const output = (Array.isArray(made) ? made[0] : made) as { output: { type: string; code?: string }[] };
  return output.output.find((chunk) => chunk.type === "chunk")?.code ?? "";
}

async function single(): Promise<string> {
  const packed = gzipSync(readFileSync(WASM), { level: 9 }).toString("base64");
  return `
const worker = ${JSON.stringify(await workerText())};
const packed = "${packed}";
export const compiledModule = async () => {
  const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  const unpacked = new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
  return WebAssembly.compile(await unpacked.arrayBuffer());
};
export const newWorker = () => {
  const url = URL.createObjectURL(new Blob([worker], { type: "text/javascript" }));
  const made = new Worker(url);
  URL.revokeObjectURL(url);
  return made;
};
`;
}

const module = (mode: string): Plugin => ({
  name: "glasswarp-module",
  resolveId: (id) => (id === ASKED ? GIVEN : undefined),
  load: (id) => (id === GIVEN ? (mode === "single" ? single() : HOSTED) : undefined),
});

const COMMON = "default-src 'none'; img-src 'self' blob: data:; base-uri 'none'; form-action 'none'";
const sha = (text: string) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;

/** The page may run its own scripts and nothing else, and ask nobody for anything. */
const policy = (rest: string): string => `<meta http-equiv="Content-Security-Policy" content="${COMMON}; ${rest}" />`;
const withPolicy = (html: string, rest: string): string => html.replace('<meta charset="utf-8" />', `<meta charset="utf-8" />\n    ${policy(rest)}`);

const hosted = (): Plugin => ({
  name: "glasswarp-hosted",
  apply: "build",
  transformIndexHtml: (html) => withPolicy(html, "script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src 'self'; connect-src 'self'; manifest-src 'self'"),
  // The service worker knows every file by name, and its own text changes with any of them.
  closeBundle() {
    const root = "dist/hosted";
    const files = readdirSync(root, { recursive: true, withFileTypes: true }).filter((file) => file.isFile() && !/sw\.js$/.test(file.name));
    const names = files.map((file) => join(file.parentPath ?? file.path, file.name).slice(root.length + 1)).sort();
    const version = createHash("sha256");
    for (const name of names) version.update(name).update(readFileSync(join(root, name)));
    const text = readFileSync("src/sw.js", "utf8");
    writeFileSync(join(root, "sw.js"), text.replace("__VERSION__", version.digest("hex").slice(0, 16)).replace('"__FILES__"', JSON.stringify(["./", ...names])));
  },
});

/** Scripts and style sheets become part of the page. */
const inlined = (): Plugin => ({
  name: "glasswarp-single",
  apply: "build",
  enforce: "post",
  generateBundle(_, bundle) {
    const page = bundle["index.html"];
    if (page?.type !== "asset") return;
    let html = String(page.source).replace(/\s*<link rel="(manifest|icon)"[^>]*>/g, "").replace(/\s*<link rel="stylesheet"[^>]*>/g, "").replace(/\s*<script type="module"[^>]*><\/script>/g, "");
    const hashes = { script: "", style: "" };
    for (const [name, file] of Object.entries(bundle)) {
      if (file.type === "chunk" && file.isEntry) {
        const code = file.code.replaceAll("</script", "<\\/script");
        hashes.script = sha(code);
        html = html.replace("</body>", () => `<script type="module">${code}</script>\n  </body>`);
      } else if (file.type === "asset" && name.endsWith(".css")) {
        hashes.style = sha(String(file.source));
        html = html.replace("</head>", () => `<style>${file.source}</style>\n  </head>`);
      } else continue;
      delete bundle[name];
    }
    const icon = readFileSync("public/icon.svg").toString("base64");
    html = html.replace("</head>", `<link rel="icon" href="data:image/svg+xml;base64,${icon}" />\n  </head>`);
    page.source = withPolicy(html, `script-src ${hashes.script} 'wasm-unsafe-eval'; worker-src blob:; style-src ${hashes.style}`);
  },
});

export default defineConfig(({ mode }) => ({
  base: "./",
  publicDir: mode === "single" ? false : "public",
  plugins: [module(mode), mode === "single" ? inlined() : hosted()],
  worker: { format: "es" },
  build: {
    target: "es2022",
    outDir: mode === "single" ? "dist/single" : "dist/hosted",
    modulePreload: false,
    assetsInlineLimit: 0,
    cssCodeSplit: false,
    chunkSizeWarningLimit: 5000,
    reportCompressedSize: false,
  },
  server: { headers: { "Cross-Origin-Opener-Policy": "same-origin", "Cross-Origin-Embedder-Policy": "require-corp" } },
}));
