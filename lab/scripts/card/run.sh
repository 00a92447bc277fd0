#!/usr/bin/env bash
# On a machine with an NVIDIA GPU, in the root of the repository, after `lab/scripts/card/pack.sh` made .card:
# runs everything that a card is to say, in less than ten minutes, without network or compilers.
# Each step has a limit, adds a line of JSON to $OUT/card.jsonl and never stops the others, but for the
# smoke test: when it fails, compute-sanitizer looks at it and the rest is left out.
# STEPS is an extended regular expression of the names of steps to run, LIMIT the seconds of all, NVRTC another library.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
. lab/scripts/card/golden.sh
OUT=${OUT:-target/card} W=${TMPDIR:-/tmp}/card STEPS=${STEPS:-.*} LIMIT=${LIMIT:-560} FRAMES=${FRAMES:-4}
mkdir -p "$OUT" "$W/lib"
: >"$OUT/card.jsonl"

# step NAME SECONDS COMMAND…
step() {
    local name=$1 limit=$2 begin=$EPOCHREALTIME rc=0
    shift 2
    [[ $name =~ ^($STEPS)$ ]] || return 0
    if [ $((LIMIT - SECONDS)) -lt "$limit" ]; then limit=$((LIMIT - SECONDS)); fi
    if [ "$limit" -lt 5 ]; then
        echo "{\"step\": \"$name\", \"rc\": \"no time left\"}" >>"$OUT/card.jsonl"
        return 1
    fi
    timeout -k 5 "$limit" "$@" >"$W/$name.out" 2>"$W/$name.err" || rc=$?
    python3 - "$name" "$rc" "$begin" "$EPOCHREALTIME" "$W/$name.out" "$W/$name.err" >>"$OUT/card.jsonl" <<'END'
import json, sys
name, rc, begin, end, out, err = sys.argv[1:]
text = open(out, errors="replace").read()
try:
    result = json.loads(text)
except ValueError:
    result = text[-12000:]
print(json.dumps({"step": name, "rc": int(rc), "seconds": round(float(end) - float(begin), 3), "result": result,
                  "errors": open(err, errors="replace").read()[-4000:]}))
END
    echo "$SECONDS s: $name, exit code $rc"
    if [ $rc != 0 ]; then tail -c 600 "$W/$name.err" "$W/$name.out"; fi
    return $rc
}
collide() {
    local name=$1 limit=$2 scene=$3
    shift 3
    step "$name" "$limit" "$W/tesdf-lab" collide "lab/recordings/$scene.json" --device "$D" --json "$@"
}
sanitize() { # NAME SECONDS TOOL OPTIONS…: compute-sanitizer on the peg
    local name=$1 limit=$2 tool=$3
    shift 3
    step "$name" "$limit" compute-sanitizer --tool "$tool" --error-exitcode 9 "$W/tesdf-lab" collide \
        lab/recordings/peg-in-hole.json --frames 1 --repeat 1 --device "$D" --json "$@"
}
profile() { # NAME KERNELS LAUNCHES OPTIONS…: counters of kernels on the bolt
    local name=$1 kernels=$2 launches=$3
    shift 3
    step "$name" 45 ncu --clock-control none --set basic --section WarpStateStats --section MemoryWorkloadAnalysis \
        --kernel-name "regex:$kernels" --launch-count "$launches" "$W/tesdf-lab" collide \
        lab/recordings/bolt-nut.json --frames 1 --repeat 1 --device "$D" "$@"
}

for program in tesdf tesdf-lab gpu_tests; do
    xz -dkc .card/$program.xz >"$W/$program"
    chmod +x "$W/$program"
done
mkdir -p "$W/kernels" "$W/python"
tar xJf .card/kernels.txz -C "$W/kernels"
tar xJf .card/python.txz -C "$W/python"
NVRTC=${NVRTC:-$(ls -d "$(python3 -c 'import sysconfig; print(sysconfig.get_path("purelib"))')"/nvidia/*/lib/libnvrtc.so.1[23] \
    /usr/local/cuda*/targets/x86_64-linux/lib/libnvrtc.so.1[23] /usr/local/cuda*/lib64/libnvrtc.so.1[23] 2>/dev/null | head -1)}
ln -sf "$NVRTC" "$W/lib/libnvrtc.so"
LD_LIBRARY_PATH="$W/lib:$(dirname "$NVRTC"):/usr/local/nvidia/lib64:${LD_LIBRARY_PATH:-}"
for f in .card/*.deb; do [ -e "$f" ] && dpkg -x "$f" /; done
ldconfig
ls /usr/share/vulkan/icd.d/*nvidia* /etc/vulkan/icd.d/*nvidia* >/dev/null 2>&1 ||
    export VK_DRIVER_FILES=/usr/local/nvidia/share/vulkan/icd.d/nvidia_icd.json
D=cuda:0
export LD_LIBRARY_PATH D W XDG_RUNTIME_DIR=$W TESDF_KERNEL_CACHE=$W/kernels TESDF_DEVICE=cuda:0 PYTHONPATH=$W/python
# Tests find data where the repository was when they were compiled.
built=$(cat .card/built_in)
if [ ! -e "$built" ]; then mkdir -p "$(dirname "$built")" && ln -s "$PWD" "$built"; fi
echo "$SECONDS s: unpacked; NVRTC $(readlink -f "$NVRTC")"

step machine 10 nvidia-smi --query-gpu=name,driver_version,memory.total,clocks.sm,clocks.max.sm,pstate --format=csv
step processor 5 sh -c 'lscpu | grep -E "Model name|^CPU\(s\)"'
step devices 20 "$W/tesdf" devices --json

# Smoke: nodes, then one frame of bolt and nut, compared with the processor's time.
if ! collide smoke_node 30 peg-in-hole --mode node --frames 1 --repeat 1 ||
    ! collide smoke 40 bolt-nut --e-max 32 --preset gpu --frames 1 --repeat 1 --against-cpu; then
    sanitize memcheck 120 memcheck --mode node
    exit 1
fi
# The machine's own NVRTC, into another cache: the registers of each kernel.
step kernels 60 env TESDF_KERNEL_CACHE="$W/compiled" "$W/tesdf-lab" kernels --json

# The same bytes as on the stand-in.
step golden 90 bash -c '. lab/scripts/card/golden.sh; golden "$W/tesdf-lab" | diff .card/golden.txt - && echo "all equal"'

# Points of torch in place, and Algorithm 1 with the paper's Q.
step torch_points 40 python3 lab/scripts/card/torch_points.py data/procedural/iso_m16_bolt_24k.obj
step algorithm1 60 "$W/tesdf" encode data/procedural/iso_m16_nut_c50.obj -o "$W/nut.tesdf" --preset paper \
    --device "$D" --json
step simulate 45 "$W/tesdf" simulate scenes/bolt-nut.toml --duration 0.2 -o "$W/run.tesrun" --device "$D" --json --force
step simulate_cpu 45 "$W/tesdf" simulate scenes/bolt-nut.toml --duration 0.2 -o "$W/run_cpu.tesrun" --json --force

# What limits the middle and the narrow phase.
profile ncu 'clip_polygons.*|narrow_faces.*' 2 --preset gpu --e-max 32
profile ncu_exact 'narrow_exact_faces.*' 1 --mode exact --contacts-per face

# The same card through Vulkan, where sums and products may be fused.
D=wgpu:0
collide vulkan 30 bolt-nut --preset gpu --e-max 32 --frames 1
TESDF_DEVICE=wgpu:0 step vulkan_tests 60 sh -c 'cd crates/tesdf-gpu && exec "$W/gpu_tests" --test-threads 2 queries inside_rules degenerate contacts'
D=cuda:0

# The paper's tables: Table II on the recorded poses, Fig. 4, Fig. 9.
step table2 90 "$W/tesdf-lab" table2 --device "$D" --preset gpu --frames "$FRAMES" --repeat 5 --format json
step table2_compact 120 "$W/tesdf-lab" table2 --device "$D" --frames "$FRAMES" --repeat 5 --format json
collide lanes_group 20 peg-in-hole --e-max 32 --preset gpu --frames 4
collide lanes_single 20 peg-in-hole --e-max 32 --preset gpu --frames 4 --lanes single
step fig9 45 "$W/tesdf-lab" fig9 --quick --device "$D" --repeat 9 --format json

# As dynamics uses it, and many worlds.
collide exact_minimum 20 bolt-nut --mode exact --contacts-per minimum --frames 4 --against-cpu
collide exact_faces 20 bolt-nut --mode exact --contacts-per face --frames 4 --against-cpu
collide nodes 15 bolt-nut --mode node --frames 4 --against-cpu
for n in 16 256 1024; do collide "worlds_$n" 60 bolt-nut --mode node --frames 1 --repeat 3 --worlds $n; done
collide worlds_exact_64 30 bolt-nut --mode exact --contacts-per minimum --frames 1 --repeat 3 --worlds 64

# The same contacts as on the processor.
step tests 300 sh -c 'cd crates/tesdf-gpu && exec "$W/gpu_tests" --test-threads 12 --skip driver_faults::'

# Races, and accesses out of bounds.
sanitize racecheck 60 racecheck --mode face
sanitize memcheck 60 memcheck --mode exact

step clocks 5 nvidia-smi --query-gpu=clocks.sm,clocks_event_reasons.active,temperature.gpu,ecc.errors.uncorrected.volatile.total --format=csv
exit 0
