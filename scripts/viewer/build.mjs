// Bundle src/ and three.js into artde_gym/motion/assets/replay.js, whose first line names its sources by their hash.
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { copyFileSync, readdirSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url)), assets = join(here, "../../artde_gym/motion/assets");
const sources = ["build.mjs", "package-lock.json", "package.json", ...readdirSync(join(here, "src")).map((name) => `src/${name}`)].sort();
const hash = createHash("sha256");
for (const name of sources) hash.update(`${name}\n`).update(readFileSync(join(here, name)));
await build({
  entryPoints: [join(here, "src/main.js")],
  outfile: join(assets, "replay.js"),
  bundle: true, minify: true, format: "iife", target: "es2022", legalComments: "eof", charset: "utf8",
  banner: { js: `/* made by \`make viewer\` of sources ${hash.digest("hex")} */` },
});
copyFileSync(join(here, "node_modules/three/LICENSE"), join(assets, "three.LICENSE.txt"));
