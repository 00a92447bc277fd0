# Sourced by pack.sh and run.sh: detections whose contacts must have the same bytes on every CUDA device.
# golden COMMAND…: prints `NAME HASH` for each; COMMAND… is tesdf-lab and what it needs.
golden() {
    local name scene options hash
    while read -r name scene options; do
        # shellcheck disable=SC2086
        hash=$("$@" collide "lab/recordings/$scene.json" --frames 1 --repeat 1 --device cuda:0 --json $options |
            sed -n 's/.*"contacts_hash": "\(.*\)".*/\1/p')
        echo "$name ${hash:-failed}"
    done <<'END'
peg-node peg-in-hole --mode node
peg-face peg-in-hole --mode face
peg-exact peg-in-hole --mode exact
peg-face-per-face peg-in-hole --mode face --contacts-per face
peg-exact-per-face peg-in-hole --mode exact --contacts-per face
peg-exact-minimum peg-in-hole --mode exact --contacts-per minimum
peg-reduced peg-in-hole --mode face --e-max 32 --reduce 8
bolt-node bolt-nut --mode node
bolt-exact-minimum bolt-nut --mode exact --contacts-per minimum
robo-exact-minimum robo-assembly --mode exact --contacts-per minimum
gears-exact-minimum engine-transmission --mode exact --contacts-per minimum
pile-node pile-of-shafts --mode node
END
}
