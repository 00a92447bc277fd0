#!/usr/bin/env bash
# Makes the package for npm in target/web/npm, and docs/demo/pkg with the same program for the page
# docs/demo/index.html. `--serve` then serves the page; `--golden` makes target/web/golden, with which
# .ci/web.sh compares bytes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
. .ci/toolchain.sh

target=wasm32-unknown-unknown
if ! rustup target add "$target" >/dev/null 2>&1 && ! rustc --print target-libdir --target "$target" 2>/dev/null | xargs -r test -d; then
    echo "error: the target $target could not be installed" >&2
    echo "hint: rustup target add $target" >&2
    exit 2
fi
web=crates/tesdf-web
out=$PWD/target/web
build() {
    (cd $web && RUSTFLAGS="-C target-feature=+simd128 -C link-arg=-zstack-size=4194304" \
        cargo build --quiet --locked --release --package tesdf-web --target $target --target-dir "$out/build" "${@:2}")
    (cd $web && cargo run --quiet --locked --package tesdf-web-bindgen --target-dir "$out/tools" -- \
        "$out/build/$target/release/tesdf_web.wasm" "$1")
}
mkdir -p "$out"
if [ "${1:-}" = --golden ]; then
    build "$out/golden" --features golden
    exit
fi
rm -rf "$out/npm" docs/demo/pkg
build "$out/npm"
cp $web/README.md $web/LICENSE-MIT $web/LICENSE-APACHE "$out/npm"
version=$(sed -n 's/^version = "\(.*\)"/\1/p' $web/Cargo.toml)
cat >"$out/npm/package.json" <<JSON
{
  "name": "tesdf",
  "version": "$version",
  "description": "Exact signed distances and contacts of triangle meshes, as WebAssembly",
  "license": "MIT OR Apache-2.0",
  "repository": "https://github.com/tesdf/tesdf",
  "type": "module",
  "main": "tesdf.js",
  "types": "tesdf.d.ts",
  "files": ["tesdf.js", "tesdf.d.ts", "tesdf_bg.wasm", "tesdf_bg.wasm.d.ts", "README.md", "LICENSE-MIT", "LICENSE-APACHE"],
  "sideEffects": false,
  "keywords": ["sdf", "collision", "mesh", "robotics", "wasm"]
}
JSON
mkdir -p docs/demo/pkg
cp "$out/npm/tesdf.js" "$out/npm/tesdf_bg.wasm" docs/demo/pkg
ls -l docs/demo/pkg
if [ "${1:-}" = --serve ]; then
    echo "the page: http://localhost:8000"
    exec python3 -m http.server 8000 --bind localhost --directory docs/demo
fi
