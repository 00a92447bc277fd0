#!/usr/bin/env bash
# Writes SHA256SUMS of the files in a folder, and signs it where TESDF_SIGNING_KEY names a private key of SSH:
#
#     .ci/checksums.sh FOLDER
#
# CONTRIBUTING.md says how to compare the files with it.
set -euo pipefail
cd "$1"

# macOS has it by another name.
sum=$(command -v sha256sum || echo "shasum -a 256")

rm -f SHA256SUMS SHA256SUMS.sig
find . -type f ! -name 'SHA256SUMS*' | sed 's,^\./,,' | LC_ALL=C sort | tr '\n' '\0' | xargs -0 $sum >SHA256SUMS.new
mv SHA256SUMS.new SHA256SUMS
$sum --check SHA256SUMS >/dev/null
if [ -n "${TESDF_SIGNING_KEY:-}" ]; then
    ssh-keygen -q -Y sign -f "$TESDF_SIGNING_KEY" -n tesdf SHA256SUMS
    ssh-keygen -q -Y check-novalidate -n tesdf -s SHA256SUMS.sig <SHA256SUMS >/dev/null
    echo "SHA256SUMS is signed: SHA256SUMS.sig"
else
    echo "warning: SHA256SUMS is not signed; TESDF_SIGNING_KEY=FILE names a private key of SSH that signs it" >&2
fi
