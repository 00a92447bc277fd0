#!/usr/bin/env bash
# Builds the package for browsers and the page docs/demo, compares the bytes of WebAssembly with those of
# all platforms in node, and tests the page in headless Chromium. Pictures are in target/web/pictures.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/chromium.sh

web=$PWD/target/web
playwright_version=1.65.1
# Without threads and the crates that need a system, the library compiles for WebAssembly, too.
RUSTFLAGS="-D warnings" step "web: library" cargo check --quiet --lib -p tesdf --no-default-features \
    --features encode,collide,gltf,threemf --target wasm32-unknown-unknown --target-dir "$web/library"
step "web: build" crates/tesdf-web/build.sh
step "web: build" crates/tesdf-web/build.sh --golden
step "web: node" node crates/tesdf-web/test/node.mjs "$web/npm" "$web/golden" crates/tesdf-sim/tests/golden/hashes.txt

if ! grep -q "\"version\": \"$playwright_version\"" "$web/packages/node_modules/playwright-core/package.json" 2>/dev/null; then
    mkdir -p "$web/packages"
    npm install --silent --no-audit --no-fund --ignore-scripts --no-save --prefix "$web/packages" "playwright-core@$playwright_version"
fi
step "web: Chromium" node crates/tesdf-web/test/page.mjs docs/demo "$web/packages" "$web/pictures"
most=3000000
found=$(cat docs/demo/*.* docs/demo/pkg/* | wc -c)
echo "the page and its program: $found bytes"
if [ "$found" -gt "$most" ]; then
    echo "error: $found bytes; expected at most $most" >&2
    exit 1
fi
