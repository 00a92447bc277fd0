# Sourced by .ci/python.sh: sets TESDF_CHROMIUM to a Chromium that runs, and TESDF_THREE to the
# folder of three.js, or explains how to install them. Tests play pages of runs in Chromium, without
# a window and without a graphics card, and read animations with three.js.
#
# It tries in this order: TESDF_CHROMIUM, `chromium` and other names in the PATH, and the package
# `chromium` of Debian. three.js comes from npm.

three_version=0.187.0
three_folder=$PWD/target/three

chromium_runs() {
    [ -n "$1" ] && command -v "$1" >/dev/null && "$1" --version >/dev/null 2>&1
}

for chromium in "${TESDF_CHROMIUM:-}" chromium chromium-browser google-chrome; do
    if chromium_runs "$chromium"; then
        break
    fi
    chromium=
done
if [ -z "$chromium" ] && command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
    apt-get install --quiet --yes --no-install-recommends chromium >/dev/null 2>&1 ||
        { apt-get update --quiet >/dev/null 2>&1 && apt-get install --quiet --yes --no-install-recommends chromium >/dev/null 2>&1; } || true
    chromium_runs chromium && chromium=chromium
fi
if [ -z "$chromium" ]; then
    echo "error: Chromium, in which tests play pages of runs, was not found and could not be installed" >&2
    echo "hint: on Debian or Ubuntu, as root: apt-get install chromium; another one by TESDF_CHROMIUM=…" >&2
    exit 2
fi
TESDF_CHROMIUM=$(command -v "$chromium")
export TESDF_CHROMIUM

TESDF_THREE=$three_folder/node_modules/three
export TESDF_THREE
if ! grep -q "\"version\": \"$three_version\"" "$TESDF_THREE/package.json" 2>/dev/null; then
    mkdir -p "$three_folder"
    if ! npm install --silent --no-audit --no-fund --ignore-scripts --no-save --prefix "$three_folder" "three@$three_version"; then
        echo "error: three.js, with which tests read animations, could not be installed into $three_folder" >&2
        echo "hint: npm is needed; on Debian or Ubuntu: apt-get install npm" >&2
        exit 2
    fi
fi
