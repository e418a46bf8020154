"""One job of a batch in a process of its own: `python -c ... JOBS BACKEND DEVICE NAME`."""

import signal
import sys

from . import _native


def main() -> None:
    """Trains the job. What goes wrong is the last line on standard error; the status is 1, or 130 if it was stopped."""
    jobs, backend, device, name = sys.argv[1:]
    # Who works through the batch stops its jobs so; a checkpoint is left.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        _native.run_job(jobs, name, backend, device or None)
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as error:  # noqa: BLE001: whatever it is, the batch keeps it with the job.
        print(f"error: {error}", file=sys.stderr)
        sys.exit(1)
