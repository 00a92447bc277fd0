"""Shared by the scripts in this folder: meshes of `data`, and Markdown tables whose heading names
the machine, date and command."""
import os
import sys
from datetime import datetime, timezone
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "data"), str(ROOT / "data" / "reference")]

# The meshes of `data` are in metres, but some peers have absolute tolerances that are meant for
# millimetres.
SCALE = 1000.0


def processor():
    return next((line.split(":", 1)[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), "unknown")


def heading(*lines):
    """prints the command, the date, the processor, and further lines"""
    program = Path(sys.argv[0]).resolve().relative_to(ROOT)
    print(f"`{' '.join([str(program), *sys.argv[1:]])}`\n")
    print(f"- {datetime.now(timezone.utc):%Y-%m-%d %H:%M} UTC, Python {sys.version.split()[0]}")
    print(f"- {processor()}; {len(os.sched_getaffinity(0))} cores, load at the start {os.getloadavg()[0]:.2f}")
    for line in lines:
        print(f"- {line}")
    print(flush=True)


def head(columns, text):
    """begins a table; the columns in `text` are aligned left, the others right"""
    print("| " + " | ".join(columns) + " |")
    print("|" + "|".join("---" if c in text else "---:" for c in columns) + "|", flush=True)


def row(cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def why(error):
    """the cell of an operation that failed"""
    text = error if isinstance(error, str) else f"{type(error).__name__}: {error}"
    return f"cannot: {text}".replace("\n", " ").replace("|", "/")
