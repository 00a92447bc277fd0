"""Checks that Ctrl-C ends a call, for several tests."""

import os
import signal
import subprocess
import sys
import time


def ended_by_ctrl_c(body, *arguments, environment=None):
    """Runs `body` in another process, which prints "started". Sends SIGINT to this process only,
    and checks how it ends."""
    # If the parent process ignores SIGINT, as for background jobs, the child would ignore it, too.
    heeding = "signal.signal(signal.SIGINT, signal.default_int_handler)"
    lines = ["import signal, sys, time, tesdf", heeding, "try:", *("    " + line for line in body), "except KeyboardInterrupt:"]
    program = "\n".join([*lines, "    print('interrupted', flush=True)", "    sys.exit(3)"])
    command = [sys.executable, "-c", program, *map(str, arguments)]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ, **(environment or {})})
    try:
        assert child.stdout.readline() == "started\n"
        # If the call follows "started", this gives it time to begin.
        time.sleep(0.3)
        child.send_signal(signal.SIGINT)
        out, _ = child.communicate(timeout=120)
    finally:
        child.kill()
    assert (out, child.returncode) == ("interrupted\n", 3)
