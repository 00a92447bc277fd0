"""What the scripts beside this share: meshes of `data`, and Markdown tables that say where, when and by which command they were made."""
import os
import sys
from datetime import datetime, timezone
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "data"), str(ROOT / "data" / "reference")]

# Peers with absolute tolerances mean them in millimetres; meshes of `data` are in metres.
SCALE = 1000.0


def processor():
    return next((line.split(":", 1)[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), "unknown")


def heading(*lines):
    """the command, the date, the processor, and further lines"""
    program = Path(sys.argv[0]).resolve().relative_to(ROOT)
    print(f"`{' '.join([str(program), *sys.argv[1:]])}`\n")
    print(f"- {datetime.now(timezone.utc):%Y-%m-%d %H:%M} UTC, Python {sys.version.split()[0]}")
    print(f"- {processor()}; {len(os.sched_getaffinity(0))} cores, load at the start {os.getloadavg()[0]:.2f}")
    for line in lines:
        print(f"- {line}")
    print(flush=True)


def head(columns, text):
    """begins a table; columns named in `text` are aligned left, the others right"""
    print("| " + " | ".join(columns) + " |")
    print("|" + "|".join("---" if c in text else "---:" for c in columns) + "|", flush=True)


def row(cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def why(error):
    """of something that cannot be done, as a cell"""
    text = error if isinstance(error, str) else f"{type(error).__name__}: {error}"
    return f"cannot: {text}".replace("\n", " ").replace("|", "/")
